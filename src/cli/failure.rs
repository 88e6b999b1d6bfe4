//! How an error reaches the user: one line on standard error, and the exit status.

use std::io::Write as _;
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Mutex;

use asid_logs::LogFormat;

/// Exit status when the work failed.
const FAILED: u8 = 1;
/// Exit status when the call was wrong.
const WRONG_CALL: u8 = 2;

/// Message and place of the latest panic.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

/// Reports a problem with the command line itself; a request for help or version is no problem.
pub fn usage(error: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind::{
        DisplayHelp, DisplayHelpOnMissingArgumentOrSubcommand, DisplayVersion,
    };
    match error.kind() {
        DisplayHelp | DisplayVersion => {
            let _ = error.print();
            ExitCode::SUCCESS
        }
        DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            ExitCode::from(WRONG_CALL)
        }
        _ => {
            tell(&(usage_line(&error.to_string()) + &about_logs(error)));
            ExitCode::from(WRONG_CALL)
        }
    }
}

/// Adds to the message about a further argument that is a log what logs are given to.
fn about_logs(error: &clap::Error) -> String {
    use clap::error::{ContextKind, ContextValue, ErrorKind};
    match (error.kind(), error.get(ContextKind::InvalidArg)) {
        (ErrorKind::UnknownArgument, Some(ContextValue::String(argument)))
            if LogFormat::is_named(Path::new(argument)) =>
        {
            "; logs become a study by: asid import LOG… --model FILE --out DIR".into()
        }
        _ => String::new(),
    }
}

/// The parser's message without its heading and its reminder of the usage.
fn usage_line(text: &str) -> String {
    let text = text.strip_prefix("error: ").unwrap_or(text);
    let end = ["\n\nUsage:", "\n\nFor more information"]
        .iter()
        .filter_map(|mark| text.find(mark))
        .min()
        .unwrap_or(text.len());
    let paragraphs: Vec<String> = text[..end]
        .split("\n\n")
        .map(one_line)
        .filter(|p| !p.is_empty())
        .collect();
    format!("{}; see --help", paragraphs.join("; "))
}

/// Writes the error and returns the exit status: wrong call or failed work.
pub fn report(error: &anyhow::Error) -> ExitCode {
    // The reader of standard output closed it early, as `head` does: that is no failure.
    let closed = |e: &std::io::Error| e.kind() == std::io::ErrorKind::BrokenPipe;
    if error.downcast_ref::<std::io::Error>().is_some_and(closed) {
        return ExitCode::SUCCESS;
    }
    let given: Vec<String> = std::env::args().collect();
    tell(&one_line(&as_given(error, &given)));
    match error.downcast_ref::<asid_core::Error>() {
        Some(e) if e.is_usage() => ExitCode::from(WRONG_CALL),
        _ => ExitCode::from(FAILED),
    }
}

/// The text of an error. A setting has the name of the option if it is one of `arguments`, and an
/// option has no other heading.
fn as_given(error: &anyhow::Error, arguments: &[String]) -> String {
    let whole = format!("{error:#}");
    let Some(asid_core::Error::Config { key, message }) = error.downcast_ref() else {
        return whole;
    };
    let is_given = |option: &String| {
        let follows = |rest: &str| rest.is_empty() || rest.starts_with('=');
        let mut given = arguments.iter();
        given.any(|argument| argument.strip_prefix(&**option).is_some_and(follows))
    };
    let options = key.split(", ").map(|key| match key.starts_with("--") {
        true => key.to_owned(),
        false => format!("--{}", key.replace('_', "-")),
    });
    let given: Vec<String> = options.filter(is_given).collect();
    let named = match &given[..] {
        [] if key.starts_with("--") => key.clone(),
        [] => return whole,
        given => given.join(", "),
    };
    whole.replace(
        &format!("config {key}: {message}"),
        &format!("{named}: {message}"),
    )
}

/// Prints a warning, which stops nothing.
pub fn warn(text: &str) {
    tell(&format!("warning: {}", one_line(text)));
}

/// Prints a line on standard error that is no warning.
pub fn note(text: &str) {
    tell(&one_line(text));
}

/// Runs `work`; a panic in it, a defect of this program or of a plugin, becomes a one-line error.
///
/// Engines catch their own panics and report them as a simulation's status, so a message is written
/// only for a panic that reaches this function. `RUST_BACKTRACE` restores the usual text.
pub fn guard(work: impl FnOnce() -> ExitCode) -> ExitCode {
    if std::env::var_os("RUST_BACKTRACE").is_none() {
        std::panic::set_hook(Box::new(|info| {
            let text = info.payload_as_str().unwrap_or("panic");
            let place = info
                .location()
                .map(|l| format!(" ({}:{})", l.file(), l.line()))
                .unwrap_or_default();
            if let Ok(mut latest) = PANIC.lock() {
                *latest = Some(format!("{text}{place}"));
            }
        }));
    }
    std::panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        tell(&one_line(&of_panic(&*payload)));
        ExitCode::from(FAILED)
    })
}

/// The message for a caught panic: the plugin's fault if it is to blame, else a defect of this
/// program.
pub fn of_panic(payload: &(dyn std::any::Any + Send)) -> String {
    if let Some(text) = payload.downcast_ref::<String>()
        && asid_core::error::blames_a_plugin(text)
    {
        return text.clone();
    }
    let said = PANIC
        .lock()
        .ok()
        .and_then(|mut latest| latest.take())
        .unwrap_or_else(|| "see above".into());
    format!("internal error: {said}; please report it with the command line")
}

/// A text as one line. Names come from files that others wrote, so control characters, which would
/// steer the terminal, are escaped.
fn one_line(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut shown = String::with_capacity(line.len());
    for c in line.chars() {
        if c.is_control() {
            shown.extend(c.escape_unicode());
        } else {
            shown.push(c);
        }
    }
    shown
}

fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "asid: {line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parsers_message_becomes_one_line() {
        let text = "error: unexpected argument '--sed' found\n\n  tip: a similar argument exists: '--seed'\n\n\
                    Usage: asid run <TASK>\n\nFor more information, try '--help'.\n";
        assert_eq!(
            usage_line(text),
            "unexpected argument '--sed' found; tip: a similar argument exists: '--seed'; see --help"
        );
    }

    /// Symptom: the name of a log's column held an escape sequence. The message about the log then
    /// changed the colour of the terminal.
    #[test]
    fn names_from_files_do_not_steer_the_terminal() {
        assert_eq!(
            one_line("column `\u{1b}[31m`\nis é"),
            "column `\\u{1b}[31m` is é"
        );
    }

    /// Symptom: `--limit-position elbow:1:0` was refused as "config limit_position", a key of a file
    /// that the user never wrote. Cause: a message names a setting by its key, wherever it is given.
    #[test]
    fn a_setting_that_an_option_gives_is_named_as_the_option() {
        let error = |key: &str| {
            anyhow::Error::from(asid_core::Error::Config {
                key: key.into(),
                message: "1 is not below 0".into(),
            })
        };
        let given = |key: &str, arguments: &[&str]| {
            let arguments: Vec<String> = arguments.iter().map(|&a| a.to_owned()).collect();
            as_given(&error(key), &arguments)
        };
        let (key, several) = ("limit_position", "limit_speed, limit_position");
        let option = "--limit-position: 1 is not below 0";
        assert_eq!(given(key, &["--limit-position", "elbow:1:0"]), option);
        assert_eq!(given(several, &["--limit-position=elbow:1:0"]), option);
        assert_eq!(given("--limit-position", &[]), option);
        assert_eq!(
            given(key, &["--limit-positions"]),
            "config limit_position: 1 is not below 0"
        );
    }

    #[test]
    fn a_panic_ends_as_a_failure_of_the_work() {
        let before = std::panic::take_hook();
        let status = guard(|| panic!("a defect"));
        std::panic::set_hook(before);
        assert_eq!(
            format!("{status:?}"),
            format!("{:?}", ExitCode::from(FAILED))
        );
    }
}
