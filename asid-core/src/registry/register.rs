//! The statement with which a part registers itself.

/// Registers a part under a name, with the package that the statement stands in.
///
/// The entry is one of [`BackendEntry`](crate::registry::BackendEntry),
/// [`TaskEntry`](crate::registry::TaskEntry), and for algorithms, which have settings,
/// [`ExplorerEntry`](crate::registry::ExplorerEntry),
/// [`IdentifierEntry`](crate::registry::IdentifierEntry) and
/// [`SolverEntry`](crate::registry::SolverEntry). `meanings`, which may be left out, tells `asid
/// config` what the settings mean: [`meanings`](crate::registry::meanings) reads it from their
/// documentation.
///
/// ```
/// use asid_core::{Explorer, Problem, Result, explore::Explored, registry};
///
/// /// Stands still.
/// #[derive(Default, serde::Serialize, serde::Deserialize)]
/// #[serde(default, deny_unknown_fields)]
/// struct Still {}
///
/// asid_core::register!(ExplorerEntry {
///     name: "still",
///     about: "stands still",
///     defaults: registry::defaults::<Still>,
///     make: |settings| Ok(Box::new(registry::settings::<Still>("explorer", settings)?)),
/// });
///
/// impl Explorer for Still {
///     fn explore<'a>(&'a self, _: &'a Problem<'a>, _: Option<&[f64]>) -> Result<Explored<'a>> {
///         Err(asid_core::Error::Failed("there is nothing to explore".into()))
///     }
/// }
///
/// assert!(registry::find::<registry::ExplorerEntry>("still").is_ok());
/// ```
#[macro_export]
macro_rules! register {
    ($entry:ident {
        name: $name:expr,
        about: $about:expr,
        make: $make:expr $(,)?
    }) => {
        $crate::__inventory::submit! {
            $crate::registry::$entry {
                name: $name,
                about: $about,
                make: &$make,
                origin: $crate::linked_origin!(),
            }
        }
    };
    ($entry:ident {
        name: $name:expr,
        about: $about:expr,
        defaults: $defaults:expr,
        make: $make:expr $(,)?
    }) => {
        $crate::register!($entry {
            name: $name,
            about: $about,
            defaults: $defaults,
            meanings: $crate::registry::unexplained,
            make: $make,
        });
    };
    ($entry:ident {
        name: $name:expr,
        about: $about:expr,
        defaults: $defaults:expr,
        meanings: $meanings:expr,
        make: $make:expr $(,)?
    }) => {
        $crate::__inventory::submit! {
            $crate::registry::$entry {
                name: $name,
                about: $about,
                defaults: &$defaults,
                meanings: &$meanings,
                make: &$make,
                origin: $crate::linked_origin!(),
            }
        }
    };
}

/// The package that calls the macro, as the origin of what it registers.
#[doc(hidden)]
#[macro_export]
macro_rules! linked_origin {
    () => {
        $crate::registry::Origin::Linked($crate::registry::Package {
            name: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
        })
    };
}
