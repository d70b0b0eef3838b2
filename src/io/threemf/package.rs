//! The package: a zip archive of parts, which have names like `/3D/3dmodel.model`.

use super::xml::{Step, Xml};
use crate::LoadError;
use crate::shared::messages::one_line;
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;
use zip::ZipArchive;

/// Bytes that the models of a package of any size may have, and what each of its bytes adds.
/// Models shrink to a tenth in zip archives, and hardly ever to a fortieth.
const FREE_BYTES: u64 = 1 << 27;
const BYTES_A_BYTE: u64 = 32;

/// Bytes that a picture may have.
const MOST_PICTURE: u64 = 1 << 28;

/// The relationship by which a package names its model.
const MODEL_TYPE: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";

pub(super) struct Package<'p> {
    path: &'p Path,
    archive: ZipArchive<Cursor<Vec<u8>>>,
    /// The entries of the archive by name, in lower case and without the first slash.
    entries: HashMap<String, usize>,
    /// Bytes that models may still have.
    pub left: u64,
}

impl<'p> Package<'p> {
    /// Opens a package. Fails if it is no zip archive.
    pub fn open(path: &'p Path, bytes: Vec<u8>) -> Result<Package<'p>, LoadError> {
        let left = FREE_BYTES.saturating_add(BYTES_A_BYTE.saturating_mul(bytes.len() as u64));
        let archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| LoadError::Invalid {
            path: path.into(),
            place: "3MF".into(),
            message: format!(
                "it is no zip archive that can be read ({})",
                one_line(&e.to_string())
            ),
        })?;
        let mut entries = HashMap::new();
        for (i, name) in archive.file_names().enumerate() {
            if let Ok(name) = name {
                entries.entry(key(&name)).or_insert(i);
            }
        }
        Ok(Package {
            path,
            archive,
            entries,
            left,
        })
    }

    /// Says whether there is a part of this name.
    pub fn has(&self, name: &str) -> bool {
        self.entries.contains_key(&key(name))
    }

    /// Opens a part as a stream. Fails with what is wrong.
    pub fn stream(&mut self, name: &str) -> Result<impl BufRead + '_, String> {
        let Some(entry) = self.entries.get(&key(name)) else {
            return Err("the package has no such part".into());
        };
        let file = self.archive.by_index(*entry);
        let file = file.map_err(|e| one_line(&e.to_string()))?;
        Ok(BufReader::with_capacity(1 << 16, file))
    }

    /// Reads a picture. Fails with what is wrong.
    pub fn picture(&mut self, name: &str) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let mut stream = self.stream(name)?.take(MOST_PICTURE + 1);
        stream
            .read_to_end(&mut bytes)
            .map_err(|e| one_line(&e.to_string()))?;
        if bytes.len() as u64 > MOST_PICTURE {
            return Err(format!("it has more than {} MiB", MOST_PICTURE >> 20));
        }
        Ok(bytes)
    }

    /// Returns the name of the package's model, which its relationships tell, or else the only one
    /// there is.
    pub fn root(&mut self) -> Result<String, LoadError> {
        let named = self.related().map_err(|message| LoadError::Invalid {
            path: self.path.into(),
            place: "_rels/.rels".into(),
            message,
        })?;
        if let Some(named) = named {
            return Ok(named);
        }
        let mut models = self.entries.keys().filter(|name| name.ends_with(".model"));
        match (models.next(), models.next()) {
            (Some(only), None) => Ok(only.clone()),
            _ => Err(LoadError::Invalid {
                path: self.path.into(),
                place: "3MF".into(),
                message: "its relationships (_rels/.rels) name no 3D model".into(),
            }),
        }
    }

    /// Reads the name of the model from the relationships of the package.
    fn related(&mut self) -> Result<Option<String>, String> {
        const RELATIONSHIPS: &str = "_rels/.rels";
        if !self.has(RELATIONSHIPS) {
            return Ok(None);
        }
        let most = self.left;
        let mut xml = Xml::new(self.stream(RELATIONSHIPS)?, most);
        loop {
            match xml.step()? {
                Step::Open(tag) if tag.name() == "Relationship" => {
                    let [kind, target] = tag.values(["Type", "Target"])?;
                    if let (Some(MODEL_TYPE), Some(target)) = (kind.as_deref(), target) {
                        return Ok(Some(target.into_owned()));
                    }
                }
                Step::End => return Ok(None),
                _ => {}
            }
        }
    }
}

/// Returns what equal names of parts have in common: they may differ in case.
pub(super) fn key(name: &str) -> String {
    let name = name.replace('\\', "/");
    name.trim_start_matches('/').to_ascii_lowercase()
}
