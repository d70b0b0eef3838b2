//! The images of a scene's files: each is read and decoded once, within one budget.
//!
//! A scene has one [`ImageStore`], which the importers of its own file and of its mesh files share.

use crate::LoadError;
use crate::scene::Image;
use crate::shared::folder::read_file;
use crate::shared::messages::one_line;
use crate::shared::texels::{ImageUse, decode};
use std::collections::HashMap;
use std::collections::hash_map::RandomState;
use std::fmt;
use std::hash::BuildHasher;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes that the decoded images of a scene may take whatever the size of their files, smaller
/// levels included.
const FREE_BYTES: u64 = 1 << 30;

/// Bytes that each byte of an image's file justifies beside those: JPEG files of photographs take a
/// bit a number and more, and a third is for smaller levels.
const BYTES_A_FILE_BYTE: u64 = 40;

/// The longest file of an image, in bytes.
const LONGEST_FILE: u64 = 1 << 30;

/// Bytes that the decoded images of a scene may take.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Those that are left.
    pub left: u64,
    all: u64,
}

impl Default for Budget {
    fn default() -> Budget {
        Budget {
            left: FREE_BYTES,
            all: FREE_BYTES,
        }
    }
}

impl Budget {
    /// Adds what a file of some bytes justifies.
    fn add_file(&mut self, bytes: usize) {
        let more = (bytes as u64).saturating_mul(BYTES_A_FILE_BYTE);
        self.left = self.left.saturating_add(more);
        self.all = self.all.saturating_add(more);
    }
}

/// Why an image is none, and the place that was the first to need it.
#[derive(Clone, Debug)]
pub struct BrokenImage {
    pub first: String,
    pub why: String,
}

impl fmt::Display for BrokenImage {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        write!(out, "{}: {}", self.first, self.why)
    }
}

type Found = Result<Arc<Image>, BrokenImage>;

/// The length of a file, and its bytes in 128 bits. The hashes' keys are random, so that no file
/// can be made to look like another.
type Digest = (usize, [u64; 2]);

/// The images read so far. Broken ones are remembered, too.
pub struct ImageStore {
    by_file: HashMap<(PathBuf, ImageUse), Found>,
    by_bytes: HashMap<(Digest, ImageUse), Found>,
    hashes: [RandomState; 2],
    budget: Budget,
}

impl Default for ImageStore {
    fn default() -> ImageStore {
        ImageStore {
            by_file: HashMap::new(),
            by_bytes: HashMap::new(),
            hashes: [RandomState::new(), RandomState::new()],
            budget: Budget::default(),
        }
    }
}

impl ImageStore {
    /// Reads the image of a file, whose path has no links; `place` is who needs it.
    pub fn file(&mut self, path: &Path, used: ImageUse, place: &str) -> Found {
        let key = (path.to_path_buf(), used);
        if let Some(known) = self.by_file.get(&key) {
            return known.clone();
        }
        let found = match read_image_file(path) {
            Ok(bytes) => self.bytes(&bytes, used, place),
            Err(why) => Err(BrokenImage {
                first: place.into(),
                why,
            }),
        };
        self.by_file.insert(key, found.clone());
        found
    }

    /// Reads an image of the bytes of its file; `place` is who needs it.
    pub fn bytes(&mut self, bytes: &[u8], used: ImageUse, place: &str) -> Found {
        let digest = (
            bytes.len(),
            self.hashes.each_ref().map(|h| h.hash_one(bytes)),
        );
        if let Some(known) = self.by_bytes.get(&(digest, used)) {
            return known.clone();
        }
        self.budget.add_file(bytes.len());
        let before = self.budget.left;
        let decoded = decode(bytes, used, &mut self.budget);
        let found = decoded.map_err(|why| BrokenImage {
            first: place.into(),
            why: one_line(&why),
        });
        let found = found.map(|it| {
            let had_alpha = it.had_alpha;
            let image = Image::new(it.texels, it.channels, used.is_color(), it.size);
            // What was dropped is given back.
            self.budget.left = before.saturating_sub(image.bytes() as u64);
            (Arc::new(image), had_alpha)
        });
        if let Ok((image, false)) = &found {
            // Colours without alpha are the same whether it counts or not.
            let twin = match used {
                ImageUse::Color => Some(ImageUse::ColorAndAlpha),
                ImageUse::ColorAndAlpha => Some(ImageUse::Color),
                ImageUse::Numbers | ImageUse::Opacity => None,
            };
            let same = || Ok(image.clone());
            self.by_bytes
                .extend(twin.map(|twin| ((digest, twin), same())));
        }
        let found = found.map(|(image, _)| image);
        self.by_bytes.insert((digest, used), found.clone());
        found
    }
}

/// Reads the bytes of an image's file. Fails with the reason.
fn read_image_file(path: &Path) -> Result<Vec<u8>, String> {
    let size = std::fs::metadata(path).map_or(0, |about| about.len());
    if size > LONGEST_FILE {
        return Err(format!(
            "its file of {} MiB is larger than {} MiB; make it smaller",
            size >> 20,
            LONGEST_FILE >> 20
        ));
    }
    read_file(path).map_err(|e| match e {
        LoadError::Read { source, .. } => one_line(&source.to_string()),
        other => one_line(&other.to_string()),
    })
}

/// Says how many MiB an image would take of those that there are.
pub(super) fn too_large([width, height]: [u32; 2], bytes: u64, budget: &Budget) -> String {
    let mib = |bytes: u64| (bytes as f64 / f64::from(1 << 20)).round();
    let rest = match budget.left < budget.all {
        true => format!(", of which {} are left", mib(budget.left).floor()),
        false => String::new(),
    };
    format!(
        "{width} × {height} texels take {} MiB, and all images of a scene at most {} (1024, and \
         {BYTES_A_FILE_BYTE} times their files){rest}; make images smaller",
        mib(bytes),
        mib(budget.all),
    )
}
