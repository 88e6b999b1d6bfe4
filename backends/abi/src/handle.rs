//! Handles of compiled scenes, and the common parts of calls with them.

use std::cell::OnceCell;
use std::ffi::{CString, c_char};
use std::ptr::NonNull;
use std::sync::Arc;

use asid_core::{Error, Layout, Result, Scene, Target};

use crate::engine::Checked;
use crate::failure::{broken, decode, encode};
use crate::table::{self, Code};
use crate::text;
use crate::world::World;
use crate::{layout, table::NONE};

/// The object behind the pointer of a scene's `world` function. The header's structure comes first;
/// the host's own data follow.
#[repr(C)]
struct HostScene<'a> {
    table: table::Scene,
    scene: &'a Scene,
    world: OnceCell<Result<World>>,
}

/// `asid_scene.world`: the host's reading of the document, made at the first request.
unsafe extern "C" fn world(
    scene: *const table::Scene,
    error: *mut table::Error,
) -> *const table::World {
    // SAFETY: the engine passes the scene that it was given, which is the first field of a
    // `HostScene`; one thread uses it while `load` runs.
    let host = unsafe { &*scene.cast::<HostScene<'_>>() };
    let read = || {
        std::panic::catch_unwind(|| World::read(host.scene)).unwrap_or_else(|_| {
            Err(Error::Scene {
                scene: host.scene.name().to_owned(),
                message: "the document cannot be read".into(),
            })
        })
    };
    match host.world.get_or_init(read) {
        Ok(world) => world.table(),
        Err(why) => {
            // SAFETY: never null, as the header says.
            encode(why, unsafe { &mut *error });
            std::ptr::null()
        }
    }
}

/// An engine's handle of a compiled scene, destroyed when its last user is dropped.
pub struct ModelHandle {
    /// The engine.
    pub engine: Arc<Checked>,
    pointer: NonNull<table::Model>,
    layout: Layout,
    /// The host's reading, if the engine requested it.
    world: Option<World>,
}

// SAFETY: the header says that functions of a model may be called from any thread.
unsafe impl Send for ModelHandle {}
// SAFETY: as above, and from several at once.
unsafe impl Sync for ModelHandle {}

impl Drop for ModelHandle {
    fn drop(&mut self) {
        if let Some(destroy) = self.engine.table.destroy_model {
            self.engine.action("destroy_model").run(|| {
                // SAFETY: made by `load`, and destroyed here only; batches and snapshots hold this
                // handle, so none is left.
                unsafe { destroy(self.pointer.as_ptr()) }
            });
        }
    }
}

impl ModelHandle {
    /// Names and indices.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The engine's handle.
    pub fn pointer(&self) -> *const table::Model {
        self.pointer.as_ptr()
    }
}

impl ModelHandle {
    /// Lets the engine compile a scene.
    ///
    /// # Errors
    /// Those of the engine, and when it breaks the contract.
    pub fn load(engine: Arc<Checked>, scene: &Scene) -> Result<Self> {
        let name = text::owned(scene.name());
        let xml = text::owned(scene.xml());
        let directory = scene
            .directory()
            .map(|d| text::owned(&d.display().to_string()));
        let host = HostScene {
            table: table::Scene {
                size: size_of::<table::Scene>() as u64,
                name: name.as_ptr(),
                xml: xml.as_ptr(),
                directory: directory.as_ref().map_or(std::ptr::null(), |d| d.as_ptr()),
                world: Some(world),
            },
            scene,
            world: OnceCell::new(),
        };
        let load = function(engine.table.load, "load", &engine)?;
        let mut pointer = std::ptr::null_mut();
        let mut error = table::Error::empty();
        let code = engine.action("load").run(|| {
            // SAFETY: everything pointed to lives until the call returns.
            unsafe { load((&raw const host).cast(), &mut pointer, &mut error) }
        });
        let about = about(code, &engine, scene.name());
        decode(code, &error, "load", &about, &engine.path)?;
        let pointer = NonNull::new(pointer)
            .ok_or_else(|| broken(&engine.path, "load", "says that all is well and gives NULL"))?;
        // From here on the handle destroys the model on every path.
        let mut handle = Self {
            engine: engine.clone(),
            pointer,
            layout: Layout::default(),
            world: host.world.into_inner().and_then(Result::ok),
        };
        handle.layout = match handle.own_layout()? {
            Some(layout) => layout,
            None => {
                let world = match handle.world.take() {
                    Some(world) => world,
                    None => World::read(scene)?,
                };
                let layout = world.layout().clone();
                handle.world = Some(world);
                layout
            }
        };
        Ok(handle)
    }

    /// The engine's own layout, if it provides one.
    fn own_layout(&self) -> Result<Option<Layout>> {
        let Some(get) = self.engine.table.layout else {
            return Ok(None);
        };
        let layout = self.engine.action("layout").run(|| {
            // SAFETY: the model lives.
            unsafe { get(self.pointer()) }
        });
        if layout.is_null() {
            return Ok(None);
        }
        // SAFETY: valid until the model is destroyed, as the header says.
        unsafe { layout::decode(layout) }
            .map(Some)
            .map_err(|e| broken(&self.engine.path, "layout", &e.to_string()))
    }
}

/// A target with its names as C strings.
pub struct NamedTarget {
    names: [CString; 3],
    index: u64,
    object: u64,
}

impl NamedTarget {
    /// The names of a target, with its element's index if the engine uses the host's reading.
    pub fn new(target: &Target, model: &ModelHandle) -> Self {
        let object = model
            .world
            .as_ref()
            .and_then(|w| w.object(&target.element, &target.name))
            .unwrap_or(NONE);
        Self {
            names: [&target.element, &target.name, &target.attribute].map(|n| text::owned(n)),
            index: target.index as u64,
            object,
        }
    }

    /// The structure; its pointers are valid as long as `self` lives.
    pub fn table(&self) -> table::Target {
        let [element, name, attribute]: [*const c_char; 3] =
            std::array::from_fn(|i| self.names[i].as_ptr());
        table::Target {
            element,
            name,
            attribute,
            index: self.index,
            object: self.object,
        }
    }
}

/// A function of the table; calling one that the engine omits is an error.
pub fn function<F>(function: Option<F>, name: &str, engine: &Checked) -> Result<F> {
    function.ok_or_else(|| broken(&engine.path, name, "the engine has no such function"))
}

/// The subject of an error where the engine does not name it: the engine if it is incapable, else
/// `asked`.
pub fn about(code: Code, engine: &Checked, asked: &str) -> String {
    if code != table::INCAPABLE {
        return asked.to_owned();
    }
    // SAFETY: checked when the table was.
    unsafe { text::read(engine.table.name, "name") }.unwrap_or_default()
}
