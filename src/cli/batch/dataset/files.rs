//! Names of the files that a picture of a data set has beside it.

use std::path::{Path, PathBuf};

/// Pictures in a chunk of BOP's.
const CHUNK: u32 = 1000;

/// The folder of BOP's pictures.
pub const SPLIT: &str = "train_pbr";

/// Returns where BOP has the picture of a task: chunk and number.
pub fn bop_place(task: u32) -> (u32, u32) {
    (task / CHUNK, task % CHUNK)
}

/// Returns the picture of a task, as BOP names it.
pub fn bop_picture(task: u32) -> String {
    let (chunk, number) = bop_place(task);
    format!("{SPLIT}/{chunk:06}/rgb/{number:06}.png")
}

/// The files beside a picture.
#[derive(Clone, Copy, Debug)]
pub struct Beside<'p> {
    pub picture: &'p Path,
    /// Whether files of a kind have a folder of their own, beside the picture's.
    pub in_folders: bool,
}

/// Kinds of files that each picture has, and their endings.
const KINDS: [(&str, &str); 5] = [
    ("depth", "png"),
    ("objects", "png"),
    ("categories", "png"),
    ("coordinates", "png"),
    ("view", "json"),
];

impl Beside<'_> {
    fn of(&self, kind: &str, number: Option<usize>, ending: &str) -> PathBuf {
        let stem = self.picture.file_stem().unwrap_or_default();
        let stem = stem.to_string_lossy();
        let number = number.map_or(String::new(), |number| format!("_{number:06}"));
        let folder = self.picture.parent().unwrap_or(Path::new(""));
        match self.in_folders {
            true => {
                let above = folder.parent().unwrap_or(Path::new(""));
                above.join(kind).join(format!("{stem}{number}.{ending}"))
            }
            false => folder.join(format!("{stem}.{kind}{number}.{ending}")),
        }
    }

    pub fn depth(&self) -> PathBuf {
        self.of("depth", None, "png")
    }

    pub fn objects(&self) -> PathBuf {
        self.of("objects", None, "png")
    }

    pub fn categories(&self) -> PathBuf {
        self.of("categories", None, "png")
    }

    pub fn coordinates(&self) -> PathBuf {
        self.of("coordinates", None, "png")
    }

    pub fn note(&self) -> PathBuf {
        self.of("view", None, "json")
    }

    /// Returns the mask of the silhouette of an object, and that of what is seen of it.
    pub fn masks(&self, object: usize) -> [PathBuf; 2] {
        ["mask", "mask_visib"].map(|kind| self.of(kind, Some(object), "png"))
    }

    /// Lists the files that there are whatever the picture shows.
    pub fn always(&self) -> Vec<PathBuf> {
        let of = |(kind, ending): &(&str, &str)| self.of(kind, None, ending);
        KINDS.iter().map(of).collect()
    }

    /// Lists the folders of all files.
    pub fn folders(&self) -> Vec<PathBuf> {
        let masks = self.masks(0);
        let all = self.always().into_iter().chain(masks);
        let mut folders: Vec<PathBuf> = all
            .filter_map(|file| file.parent().map(Into::into))
            .collect();
        folders.dedup();
        folders
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_lie_beside_their_picture() {
        let picture = bop_picture(12_345);
        assert_eq!(picture, "train_pbr/000012/rgb/000345.png");
        let of = |in_folders| Beside {
            picture: picture.as_ref(),
            in_folders,
        };
        let path = |text: &str| PathBuf::from(text);
        assert_eq!(of(true).depth(), path("train_pbr/000012/depth/000345.png"));
        let masks = of(true).masks(7);
        assert_eq!(
            masks[1],
            path("train_pbr/000012/mask_visib/000345_000007.png")
        );
        assert_eq!(
            of(false).note(),
            path("train_pbr/000012/rgb/000345.view.json")
        );
        assert_eq!(of(false).folders(), [path("train_pbr/000012/rgb")]);
        assert_eq!(of(true).folders().len(), 7);
    }
}
