//! A scene: one MJCF document that every backend loads.
//!
//! MJCF is the common language of the engines, so the scene *is* the document and nothing more.
//! Includes are spliced in as text when it is read, not by an engine. Every engine therefore sees
//! the same bytes, and `asid export` writes exactly what was simulated.

mod normal_form;

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use asid_documents::guard::{guarded, one_line};
use asid_documents::xml::{Fault, parse, spliced, wrong_eulerseq, wrong_number};

use crate::error::{Error, Result};
use normal_form::{attached_last, normal_form};

/// One MJCF document with its includes spliced in.
#[derive(Clone)]
pub struct Scene {
    name: String,
    xml: String,
    directory: Option<PathBuf>,
    /// The parsed document, once requested; clones share it.
    description: Arc<OnceLock<Arc<mjcf_rs::Model>>>,
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scene")
            .field("name", &self.name)
            .field("xml", &self.xml)
            .field("directory", &self.directory)
            .finish_non_exhaustive()
    }
}

impl PartialEq for Scene {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && self.xml == other.xml && self.directory == other.directory
    }
}

impl Scene {
    /// Reads a document and its includes from files.
    ///
    /// # Errors
    /// When a file is missing, is not well-formed XML, or is not MJCF; the
    /// message names file, line and column.
    pub fn from_file(path: &Path) -> Result<Self> {
        let xml = read(path)?;
        let directory = path.parent().map(Path::to_path_buf).unwrap_or_default();
        let name = path.display().to_string();
        let from = directory.clone();
        let xml = spliced(&name, &xml, &|file| read(&from.join(file)))?;
        Self::checked(name, xml, Some(directory))
    }

    /// A document in memory; `includes` are pairs of file name, as written in the document, and
    /// text.
    ///
    /// # Errors
    /// As [`Scene::from_file`].
    pub fn from_xml(name: &str, xml: &str, includes: &[(&str, &str)]) -> Result<Self> {
        let xml = spliced(name, xml, &|file| {
            includes
                .iter()
                .find(|(n, _)| *n == file)
                .map(|(_, text)| (*text).to_owned())
                .ok_or_else(|| Fault::new(name, format!("included file `{file}` is not there")))
        })?;
        Self::checked(name.to_owned(), xml, None)
    }

    fn checked(name: String, xml: String, directory: Option<PathBuf>) -> Result<Self> {
        let document = parse(&name, &xml)?;
        let root = document.root_element().tag_name().name().to_owned();
        if root != "mujoco" {
            return Err(Error::Scene {
                scene: name,
                message: format!("the root element is <{root}>, but MJCF begins with <mujoco>"),
            });
        }
        let order = wrong_eulerseq(&document).map(|(node, given)| {
            let what = "is not three of the letters x, y, z, X, Y and Z";
            (node, format!("eulerseq=\"{given}\" {what}"))
        });
        if let Some((node, what)) = order.or_else(|| wrong_number(&document)) {
            let line = document.text_pos_at(node.range().start).row;
            return Err(Error::Scene {
                scene: name,
                message: format!("line {line}: {what}"),
            });
        }
        Ok(Self {
            name,
            xml,
            directory,
            description: Arc::default(),
        })
    }

    /// The same scene with another folder for relative asset paths.
    #[must_use]
    pub fn in_directory(self, directory: Option<PathBuf>) -> Self {
        Self {
            directory,
            description: Arc::default(),
            ..self
        }
    }

    /// Path or name under which it was read.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The whole document, with includes spliced in.
    #[must_use]
    pub fn xml(&self) -> &str {
        &self.xml
    }

    /// Base folder of relative asset paths; `None` for a scene from memory.
    #[must_use]
    pub fn directory(&self) -> Option<&Path> {
        self.directory.as_deref()
    }

    /// The parsed document with defaults resolved, for what is read from a scene without an engine
    /// (kinematics, mass properties, names).
    ///
    /// It means what MuJoCo compiles: classes count entry by entry, and frames move whatever is in
    /// them. It is parsed once. A solver makes an arm's controller for each attempt, which then
    /// costs no parsing.
    ///
    /// # Errors
    /// When the document is not valid MJCF, or a `<frame>` holds an `<attach>`.
    pub fn description(&self) -> Result<Arc<mjcf_rs::Model>> {
        if let Some(parsed) = self.description.get() {
            return Ok(Arc::clone(parsed));
        }
        let base = self.directory.clone().unwrap_or_default();
        let xml = normal_form(&self.name, &self.xml)?;
        let parse = || mjcf_rs::Model::from_str(&xml, &base).map_err(|e| e.to_string());
        let mut parsed = guarded("an MJCF document", parse).map_err(|message| Error::Scene {
            scene: self.name.clone(),
            message: one_line(&message),
        })?;
        attached_last(&self.name, &xml, &mut parsed)?;
        Ok(Arc::clone(
            self.description.get_or_init(|| Arc::new(parsed)),
        ))
    }

    /// The same scene with another document.
    fn with_xml(&self, xml: String) -> Self {
        Self {
            name: self.name.clone(),
            xml,
            directory: self.directory.clone(),
            description: Arc::default(),
        }
    }

    /// The same scene with another value of an attribute of the element `<tag name="name">`.
    ///
    /// # Errors
    /// When the document has no such element, or `value` holds a quotation mark.
    pub fn with_attribute(
        &self,
        tag: &str,
        name: &str,
        attribute: &str,
        value: &str,
    ) -> Result<Self> {
        let fail = |message: String| Error::Scene {
            scene: self.name.clone(),
            message,
        };
        if value.contains(['"', '<', '&']) {
            return Err(fail(format!("`{value}` is no value of an attribute")));
        }
        let document = parse(&self.name, &self.xml)?;
        let node = document
            .descendants()
            .find(|n| n.has_tag_name(tag) && n.attribute("name") == Some(name))
            .ok_or_else(|| fail(format!("has no <{tag}> named `{name}`")))?;
        let mut xml = self.xml.clone();
        match node.attribute_node(attribute) {
            Some(found) => xml.replace_range(found.range_value(), value),
            None => {
                // Insert after the tag's name.
                let at = node.range().start + 1 + tag.len();
                xml.insert_str(at, &format!(" {attribute}=\"{value}\""));
            }
        }
        Ok(self.with_xml(xml))
    }

    /// The same scene with another physics time step, seconds.
    ///
    /// # Errors
    /// When `timestep` is not a positive number.
    pub fn with_timestep(&self, timestep: f64) -> Result<Self> {
        if !(timestep.is_finite() && timestep > 0.0) {
            return Err(Error::Config {
                key: "timestep".into(),
                message: format!("must be a positive number of seconds, not {timestep}"),
            });
        }
        let document = parse(&self.name, &self.xml)?;
        let value = format!("{timestep:?}");
        // The last value of a repeated section wins, so an option element at the end overrides the
        // document.
        let end = document.root_element().range().end;
        let close = self.xml[..end].rfind("</").ok_or_else(|| Error::Scene {
            scene: self.name.clone(),
            message: "the document is empty".into(),
        })?;
        // From the back, so that the places before stay.
        let mut edits = vec![(close..close, format!("<option timestep=\"{value}\"/>\n"))];
        let before = self.description()?.option.timestep;
        edits.extend(longer_buffers(&document, before / timestep));
        edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
        let mut xml = self.xml.clone();
        edits
            .into_iter()
            .for_each(|(range, with)| xml.replace_range(range, &with));
        Ok(self.with_xml(xml))
    }
}

/// Buffers of delays (`nsample`, in steps) that hold as long where there are `more` steps to a second,
/// with their places in the text.
///
/// Two more hold the ends of the interval in which a delay lies.
fn longer_buffers(
    document: &roxmltree::Document<'_>,
    more: f64,
) -> Vec<(std::ops::Range<usize>, String)> {
    let buffers = document.descendants().filter_map(|node| {
        let buffer = node.attribute_node("nsample")?;
        let samples: f64 = buffer.value().trim().parse().ok()?;
        let longer = (samples * more).ceil() + 2.0;
        (samples > 0.0 && more > 1.0).then(|| (buffer.range_value(), format!("{longer}")))
    });
    buffers.collect()
}

fn read(path: &Path) -> Result<String, Fault> {
    std::fs::read_to_string(path).map_err(|e| {
        let message = match e.kind() {
            std::io::ErrorKind::NotFound => "no such file".into(),
            std::io::ErrorKind::InvalidData => "is not UTF-8 text".into(),
            _ => e.to_string(),
        };
        Fault::new(path.display().to_string(), message)
    })
}

impl From<Fault> for Error {
    fn from(fault: Fault) -> Self {
        Self::Scene {
            scene: fault.document,
            message: fault.message,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn includes_are_spliced_in_place() {
        let scene = Scene::from_xml(
            "outer",
            r#"<mujoco><include file="inner.xml"/><worldbody/></mujoco>"#,
            &[(
                "inner.xml",
                r#"<mujocoinclude><option timestep="0.01"/></mujocoinclude>"#,
            )],
        )
        .unwrap();
        assert_eq!(
            scene.xml(),
            r#"<mujoco><option timestep="0.01"/><worldbody/></mujoco>"#
        );
    }

    /// Symptom: a drive's own delay of 20 ms was one of 12 ms at half the time step.
    ///
    /// Cause: its buffer holds as many steps as before, which take half the time.
    #[test]
    fn delays_stay_where_the_time_step_is_another() {
        let drive = r#"<motor name="m" joint="j" delay="0.02" nsample="12"/>"#;
        let xml = format!(
            r#"<mujoco><option timestep="0.002"/><worldbody><body><joint name="j"/><geom size="1"/></body></worldbody><actuator>{drive}</actuator></mujoco>"#
        );
        let scene = Scene::from_xml("delayed", &xml, &[]).unwrap();
        let samples = |timestep: f64| {
            let other = scene.with_timestep(timestep).unwrap();
            let (_, rest) = other.xml().split_once("nsample=\"").unwrap();
            rest.split_once('"').unwrap().0.parse::<f64>().unwrap()
        };
        assert!(samples(0.001) >= 24.0 && samples(0.0005) >= 48.0);
        assert_eq!(samples(0.002), 12.0);
        assert_eq!(samples(0.004), 12.0);
    }

    /// Symptom: a document that MuJoCo reads was refused, without a line.
    #[test]
    fn bit_masks_below_zero_and_bodies_that_sleep_are_read() {
        let xml = r#"<mujoco><worldbody><body name="a" sleep="never"><joint/><geom size="0.1" contype="-1" conaffinity="3"/></body></worldbody></mujoco>"#;
        let scene = Scene::from_xml("masks", xml, &[]).unwrap();
        let all = scene.description().unwrap();
        let geom = &all.bodies[1].body.geoms[0];
        assert_eq!((geom.contype, geom.conaffinity), (u32::MAX, 3));
    }

    #[test]
    fn includes_that_multiply_are_refused() {
        let files: Vec<(String, String)> = (0..7)
            .map(|k| {
                let next = format!("<include file=\"{}.xml\"/>", k + 1).repeat(9);
                (
                    format!("{k}.xml"),
                    format!("<mujocoinclude>{next}</mujocoinclude>"),
                )
            })
            .chain([("7.xml".into(), "<mujocoinclude/>".into())])
            .collect();
        let files: Vec<(&str, &str)> = files.iter().map(|(n, t)| (&**n, &**t)).collect();
        let root = r#"<mujoco><include file="0.xml"/></mujoco>"#;
        let error = Scene::from_xml("many", root, &files)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("more than 1000 files are included"),
            "{error}"
        );
    }

    #[test]
    fn an_include_cycle_is_an_error() {
        let error = Scene::from_xml(
            "a.xml",
            r#"<mujoco><include file="a.xml"/></mujoco>"#,
            &[("a.xml", r#"<mujoco><include file="a.xml"/></mujoco>"#)],
        )
        .unwrap_err();
        assert!(error.to_string().contains("cycle"), "{error}");
    }

    /// Symptom: a document of 260 kB ended the process by a stack overflow. Cause: 25 000 nested
    /// elements, which the XML parser follows by recursion.
    #[test]
    fn elements_that_are_nested_without_end_are_refused() {
        let nested = |n: usize| {
            let (open, close) = ("<body>".repeat(n), "</body>".repeat(n));
            format!("<mujoco><worldbody>{open}{close}</worldbody></mujoco>")
        };
        for xml in [nested(40_000), "<a>".repeat(100_000)] {
            let error = Scene::from_xml("deep", &xml, &[]).unwrap_err().to_string();
            assert!(error.contains("nested deeper than 256"), "{error}");
        }
        assert!(Scene::from_xml("deep", &nested(asid_documents::xml::MAX_LEVELS - 2), &[]).is_ok());
    }

    /// Symptom: "index out of bounds: the len is 3 but the index is 3" from the MJCF parser. Cause:
    /// a fourth axis.
    #[test]
    fn an_order_of_four_euler_axes_is_refused() {
        let xml = |axes: &str| {
            format!(
                "<mujoco>\n<compiler eulerseq='{axes}'/><worldbody><body euler='0 1 2'/></worldbody></mujoco>"
            )
        };
        for axes in ["xyzx", "xy", "abc", "éx"] {
            let error = Scene::from_xml("s", &xml(axes), &[])
                .unwrap_err()
                .to_string();
            assert!(error.contains("line 2: eulerseq"), "{error}");
        }
        assert!(
            Scene::from_xml("s", &xml("XYZ"), &[])
                .unwrap()
                .description()
                .is_ok()
        );
    }

    /// Symptom: an abort in a replay, or fits to a body of negative mass. Cause: a time step of zero,
    /// and numbers that some engine computes with.
    #[test]
    fn numbers_that_no_machine_has_are_refused() {
        let scene = |line: &str| {
            let xml =
                format!("<mujoco>\n{line}\n<worldbody><body name='inf'/></worldbody></mujoco>");
            Scene::from_xml("s", &xml, &[])
        };
        for line in [
            "<option timestep='0'/>",
            "<option timestep='-0.1'/>",
            "<option gravity='0 0 nan'/>",
            "<default><geom mass='-0.5'/></default>",
            "<default><geom density='-1'/></default>",
            "<default><geom mass='inf'/></default>",
        ] {
            // A body may be called so, and `mass` then is no reference to it.
            let line = line.replace("'inf'", "'infinity'");
            let error = scene(&line).unwrap_err().to_string();
            assert!(error.contains("line 2: "), "{error}");
        }
        assert!(scene("<contact><exclude body1='inf' body2='world'/></contact>").is_ok());
    }

    #[test]
    fn malformed_xml_names_the_place() {
        let error = Scene::from_xml("bad.xml", "<mujoco><body></mujoco>", &[]).unwrap_err();
        let text = error.to_string();
        assert!(
            text.starts_with("scene bad.xml: is not well-formed XML"),
            "{text}"
        );
        assert!(text.contains("1:"), "{text}");
    }

    #[test]
    fn another_root_is_refused() {
        let error = Scene::from_xml("robot.urdf", "<robot/>", &[]).unwrap_err();
        assert!(error.to_string().contains("<robot>"), "{error}");
    }

    #[test]
    fn the_last_timestep_wins() {
        let scene = Scene::from_xml(
            "s",
            r#"<mujoco><option timestep="0.01"/><worldbody/></mujoco>"#,
            &[],
        )
        .unwrap()
        .with_timestep(0.001)
        .unwrap();
        let model = scene.description().unwrap();
        assert!((model.option.timestep - 0.001).abs() < 1e-12);
    }

    #[test]
    fn an_attribute_is_set_where_it_is_and_where_it_is_not() {
        let xml = r#"<mujoco><worldbody><body name="b" pos="0 0 1"><geom name="b" size="1"/></body></worldbody></mujoco>"#;
        let scene = Scene::from_xml("s", xml, &[]).unwrap();
        assert_eq!(scene.description().unwrap().bodies.len(), 2);
        let other = scene
            .with_attribute("geom", "b", "size", "0.5")
            .and_then(|s| s.with_attribute("geom", "b", "mass", "2"))
            .unwrap();
        let expected = xml.replace(
            r#"<geom name="b" size="1"/>"#,
            r#"<geom mass="2" name="b" size="0.5"/>"#,
        );
        assert_eq!(other.xml(), expected);
        assert_eq!(
            other.description().unwrap().bodies[1].body.geoms[0].mass,
            Some(2.0)
        );
        assert_ne!(scene, other);
        assert!(scene.with_attribute("geom", "c", "size", "1").is_err());
        assert!(scene.with_attribute("geom", "b", "size", "1\"").is_err());
    }

    #[test]
    fn a_document_is_parsed_once_for_all_clones() {
        let scene = Scene::from_xml("s", "<mujoco><worldbody/></mujoco>", &[]).unwrap();
        let first = scene.description().unwrap();
        assert!(Arc::ptr_eq(&first, &scene.clone().description().unwrap()));
        let slower = scene.with_timestep(0.5).unwrap();
        assert!(!Arc::ptr_eq(&first, &slower.description().unwrap()));
    }
}
