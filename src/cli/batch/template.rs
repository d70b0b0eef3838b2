//! Names of pictures: a template with places such as `{scene}` and `{frame:04}`.

use super::job::nearest;
use std::path::{Component, Path, PathBuf};

/// What stands in a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// The scene file's name without its ending.
    Scene,
    /// That with its ending.
    File,
    /// The folder of the scene file, as the job names it.
    Folder,
    Camera,
    Variant,
    Frame,
    /// The number of the draw of random options.
    Draw,
    Task,
}

const FIELDS: [(&str, Field); 8] = [
    ("scene", Field::Scene),
    ("file", Field::File),
    ("folder", Field::Folder),
    ("camera", Field::Camera),
    ("variant", Field::Variant),
    ("frame", Field::Frame),
    ("draw", Field::Draw),
    ("task", Field::Task),
];

/// The most digits of a number.
const MOST_DIGITS: usize = 20;

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    /// A field, and of numbers the least count of digits.
    Field(Field, usize),
}

/// A template that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Template(Vec<Piece>);

/// What a place gets.
pub enum Value<'a> {
    Name(&'a str),
    Number(u32),
    /// The components of a path.
    Path(&'a Path),
}

impl Template {
    /// Reads a template. Fails with the remedy.
    pub fn parse(text: &str) -> Result<Template, String> {
        let mut pieces = Vec::new();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once('{') {
            let Some((place, next)) = after.split_once('}') else {
                return Err(format!("'{text}': a {{ has no }} after it"));
            };
            pieces.push(Piece::Text(before.into()));
            pieces.push(field(place)?);
            rest = next;
        }
        pieces.push(Piece::Text(rest.into()));
        let stray = |piece: &Piece| matches!(piece, Piece::Text(text) if text.contains('}'));
        match pieces.iter().any(stray) {
            true => Err(format!("'{text}': a }} has no {{ before it")),
            false => Ok(Template(pieces)),
        }
    }

    /// Says whether a field stands in the template.
    pub fn has(&self, field: Field) -> bool {
        let is = |piece: &Piece| matches!(piece, Piece::Field(other, _) if *other == field);
        self.0.iter().any(is)
    }

    /// Fills the places of a scene's names; others stay empty.
    pub fn of_scene(&self, scene: &Path) -> String {
        let file = scene.file_name().unwrap_or_default().to_string_lossy();
        let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
        self.filled(|field| match field {
            Field::Scene => Value::Name(&stem),
            Field::File => Value::Name(&file),
            Field::Folder => Value::Path(scene.parent().unwrap_or(Path::new(""))),
            _ => Value::Name(""),
        })
    }

    /// Fills the places. Names that hold what a path must not are changed there.
    pub fn filled<'a>(&self, value: impl Fn(Field) -> Value<'a>) -> String {
        let mut text = String::new();
        // Of no folder, the / after it is left out, too.
        let mut is_empty = false;
        for piece in &self.0 {
            let follows = std::mem::take(&mut is_empty);
            match piece {
                Piece::Text(piece) if follows => {
                    text.push_str(piece.strip_prefix('/').unwrap_or(piece));
                }
                Piece::Text(piece) => text.push_str(piece),
                Piece::Field(field, digits) => match value(*field) {
                    Value::Name(name) => text.push_str(&one_name(name)),
                    Value::Number(number) => text.push_str(&format!("{number:0digits$}")),
                    Value::Path(path) => {
                        let names = path.components().filter_map(|part| match part {
                            Component::Normal(name) => Some(one_name(&name.to_string_lossy())),
                            _ => None,
                        });
                        let path: PathBuf = names.collect();
                        is_empty =
                            path.as_os_str().is_empty() && (text.is_empty() || text.ends_with('/'));
                        text.push_str(&path.to_string_lossy());
                    }
                },
            }
        }
        text
    }
}

fn field(place: &str) -> Result<Piece, String> {
    let (name, digits) = match place.split_once(':') {
        Some((name, digits)) => (name, Some(digits)),
        None => (place, None),
    };
    let found = FIELDS.iter().find(|(known, _)| *known == name);
    let Some((_, field)) = found else {
        let hint = nearest(name, FIELDS.iter().map(|(name, _)| *name));
        let hint = hint.map_or(String::new(), |near| format!(" did you mean {{{near}}}?"));
        let known: Vec<String> = FIELDS
            .iter()
            .map(|(name, _)| format!("{{{name}}}"))
            .collect();
        return Err(format!(
            "{{{place}}} is unknown;{hint} known are {}",
            known.join(" ")
        ));
    };
    let is_number = matches!(field, Field::Frame | Field::Draw | Field::Task);
    let digits = match digits {
        None => 1,
        Some(digits) => match digits.parse() {
            Ok(digits @ 1..=MOST_DIGITS) if is_number => digits,
            _ => {
                return Err(format!(
                    "{{{place}}}: numbers take a count of digits, such as {{frame:04}}, and names \
                     nothing"
                ));
            }
        },
    };
    Ok(Piece::Field(*field, digits))
}

/// Returns a name as one component of a path.
fn one_name(name: &str) -> String {
    let plain = |c: char| match c {
        '/' | '\\' | ':' => '_',
        c if c.is_control() => '_',
        c => c,
    };
    let name: String = name.chars().map(plain).collect();
    match name.is_empty() || name.starts_with('.') {
        true => format!("_{name}"),
        false => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_filled() {
        let filled = |template: &str| {
            Template::parse(template)
                .unwrap()
                .filled(|field| match field {
                    Field::Scene => Value::Name("a.b"),
                    Field::File => Value::Name("a.b.stl"),
                    Field::Folder => Value::Path(Path::new("/x/../y")),
                    Field::Camera => Value::Name("../up/1"),
                    Field::Variant => Value::Name(""),
                    Field::Frame => Value::Number(7),
                    Field::Draw => Value::Number(8),
                    Field::Task => Value::Number(123_456),
                })
        };
        assert_eq!(filled("{scene}_{frame:04}.png"), "a.b_0007.png");
        assert_eq!(filled("{folder}/{camera}.exr"), "x/y/_.._up_1.exr");
        assert_eq!(filled("{variant}{task:05}{frame}"), "_1234567");
        assert_eq!(filled("x"), "x");
        let here = |template: &str| {
            let template = Template::parse(template).unwrap();
            template.of_scene(Path::new("a.stl"))
        };
        assert_eq!(here("{folder}/{scene}.png"), "a.png");
        assert_eq!(here("x/{folder}/{scene}.png"), "x/a.png");
        assert_eq!(here("x{folder}/{scene}.png"), "x/a.png");
    }

    #[test]
    fn what_is_wrong_is_said() {
        let said = |template: &str| Template::parse(template).unwrap_err();
        assert!(said("{cam}.png").contains("did you mean {camera}?"));
        assert!(said("{}").contains("known are {scene} {file} {folder}"));
        assert!(said("{scene:3}").contains("{frame:04}"));
        assert!(said("{frame:99}").contains("{frame:04}"));
        assert!(said("{scene").contains("no }"));
        assert!(said("scene}").contains("no {"));
    }
}
