//! Errors as Python exceptions, with the line that the command line would print.

use asid_core::Error;
use pyo3::PyErr;

mod exceptions {
    //! The exception classes. They are defined in Python, so that the functions that call the
    //! program raise the same ones.
    #![allow(missing_docs)]
    pyo3::import_exception!(asid.errors, AsidError);
    pyo3::import_exception!(asid.errors, UsageError);
}

/// The exception of an error: `UsageError` for a wrong call, else `AsidError`.
pub fn exception(error: &Error) -> PyErr {
    let line = error.to_string();
    if error.is_usage() {
        exceptions::UsageError::new_err(line)
    } else {
        exceptions::AsidError::new_err(line)
    }
}

/// The exception of a call whose arrays or names do not fit.
pub fn usage(line: String) -> PyErr {
    exceptions::UsageError::new_err(line)
}

/// The exception for a thread that ended unexpectedly.
pub fn ended() -> PyErr {
    exceptions::AsidError::new_err(
        "internal error: the thread of the episodes ended; please report it with what stands above",
    )
}
