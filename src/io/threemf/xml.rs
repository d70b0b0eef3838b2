//! The XML of a part: elements with their namespaces, read as a stream of bounded memory.

use crate::shared::messages::one_line;
use quick_xml::events::{BytesStart, Event};
use quick_xml::name::{Namespace, NamespaceResolver, QName, ResolveResult};
use quick_xml::reader::NsReader;
use std::borrow::Cow;
use std::fmt;
use std::io::{BufRead, Error, Read};

/// Bytes that one tag, comment or text may have.
const MOST_TOKEN: usize = 1 << 24;

/// The namespaces that are known by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Space {
    /// The core specification, and what has no namespace.
    Core,
    Material,
    Production,
    TriangleSets,
    BeamLattice,
    Slice,
    SecureContent,
    Boolean,
    Displacement,
    Volumetric,
    Implicit,
    /// Any other one, of which nothing is known.
    Other,
}

impl Space {
    /// Returns the namespace of this name, of any year.
    pub fn named(name: &str) -> Space {
        // A namespace is `http://schemas.…/3dmanufacturing/KIND/YEAR/MONTH`.
        let rest = name.split_once("/3dmanufacturing/").map(|(_, rest)| rest);
        match rest.and_then(|rest| rest.split('/').next()) {
            Some("core") => Space::Core,
            Some("material") => Space::Material,
            Some("production") => Space::Production,
            Some("trianglesets") => Space::TriangleSets,
            Some("beamlattice") => Space::BeamLattice,
            Some("slice") => Space::Slice,
            Some("securecontent") => Space::SecureContent,
            Some("booleans") => Space::Boolean,
            Some("displacement") => Space::Displacement,
            Some("volumetric") => Space::Volumetric,
            Some("implicit") => Space::Implicit,
            _ => Space::Other,
        }
    }

    fn of(found: &ResolveResult) -> Space {
        match found {
            ResolveResult::Bound(Namespace(name)) => Space::named(name),
            // Parts that are no models have names without a prefix.
            ResolveResult::Unbound => Space::Core,
            ResolveResult::Unknown(_) => Space::Other,
        }
    }

    /// What the extension adds to geometry; `None` if it adds nothing.
    pub fn geometry(self) -> Option<&'static str> {
        Some(match self {
            Space::BeamLattice => "beam lattice",
            Space::Slice => "stack of slices",
            Space::SecureContent => "encrypted content",
            Space::Boolean => "boolean shape",
            Space::Displacement => "displaced mesh",
            Space::Volumetric => "volumetric content",
            Space::Implicit => "implicit function",
            _ => return None,
        })
    }
}

/// A reader that counts lines, and stops with an error after so many bytes, of one token or of
/// all.
pub(super) struct Metered<R> {
    inner: R,
    /// Bytes that may still be read.
    left: u64,
    /// Bytes that the token may still have.
    token: usize,
    line: u64,
}

impl<R: BufRead> Read for Metered<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let have = self.fill_buf()?;
        let count = have.len().min(out.len());
        out[..count].copy_from_slice(&have[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Metered<R> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        let have = self.inner.fill_buf()?;
        if have.is_empty() {
            return Ok(have);
        }
        if self.left == 0 {
            return Err(Error::other(
                "it holds far more than the size of the file justifies",
            ));
        }
        if self.token == 0 {
            return Err(Error::other(format!(
                "a tag or text has more than {} MiB",
                MOST_TOKEN >> 20
            )));
        }
        let most = usize::try_from(self.left).unwrap_or(usize::MAX);
        Ok(&have[..have.len().min(most).min(self.token)])
    }

    fn consume(&mut self, count: usize) {
        // The bytes are still there: this only takes them from the buffer.
        if let Ok(have) = self.inner.fill_buf() {
            let lines = have[..count.min(have.len())].iter();
            self.line += lines.filter(|b| **b == b'\n').count() as u64;
        }
        self.inner.consume(count);
        self.left -= count as u64;
        self.token -= count;
    }
}

/// The elements of an XML document in turn.
pub(super) struct Xml<R> {
    reader: NsReader<Metered<R>>,
    buffer: Vec<u8>,
}

/// What comes next.
pub(super) enum Step<'x> {
    Open(Tag<'x>),
    Close,
    /// Text, a comment, or an instruction.
    Other,
    End,
}

/// An element's name and attributes.
pub(super) struct Tag<'x> {
    pub space: Space,
    start: BytesStart<'x>,
    resolver: &'x NamespaceResolver,
}

impl<R: BufRead> Xml<R> {
    /// Begins a document, of which no more than `most` bytes are read.
    pub fn new(inner: R, most: u64) -> Xml<R> {
        let mut reader = NsReader::from_reader(Metered {
            inner,
            left: most,
            token: MOST_TOKEN,
            line: 1,
        });
        reader.config_mut().expand_empty_elements = true;
        Xml {
            reader,
            buffer: Vec::new(),
        }
    }

    /// Returns the line that has been read to, from 1.
    pub fn line(&self) -> u64 {
        self.reader.get_ref().line
    }

    /// Returns how many bytes may still be read.
    pub fn left(&self) -> u64 {
        self.reader.get_ref().left
    }

    /// Reads on. Fails with what is wrong where the document is not well-formed.
    pub fn step(&mut self) -> Result<Step<'_>, String> {
        self.buffer.clear();
        self.reader.get_mut().token = MOST_TOKEN;
        let (found, event) = self
            .reader
            .read_resolved_event_into(&mut self.buffer)
            .map_err(|e| malformed(&e))?;
        let space = Space::of(&found);
        Ok(match event {
            Event::Start(start) => Step::Open(Tag {
                space,
                start,
                resolver: self.reader.resolver(),
            }),
            Event::End(_) => Step::Close,
            Event::Eof => Step::End,
            Event::DocType(_) => return Err("it has a document type, which 3MF forbids".into()),
            _ => Step::Other,
        })
    }
}

impl Tag<'_> {
    /// Returns the name without its prefix.
    pub fn name(&self) -> &str {
        self.start.local_name().into_inner()
    }

    /// Returns the values of attributes without a prefix.
    pub fn values<const N: usize>(
        &self,
        names: [&str; N],
    ) -> Result<[Option<Cow<'_, str>>; N], String> {
        let mut values = [const { None }; N];
        for attribute in self.start.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| malformed(&e))?;
            let key = attribute.key.into_inner();
            if let Some(at) = names.iter().position(|name| *name == key) {
                values[at] = Some(unescaped(attribute.value)?);
            }
        }
        Ok(values)
    }

    /// Returns the value of an attribute with a prefix of this namespace.
    pub fn value_in(&self, space: Space, name: &str) -> Result<Option<Cow<'_, str>>, String> {
        for attribute in self.start.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| malformed(&e))?;
            let (found, local) = self.resolver.resolve_attribute(attribute.key);
            if local.into_inner() == name
                && matches!(found, ResolveResult::Bound(_))
                && Space::of(&found) == space
            {
                return unescaped(attribute.value).map(Some);
            }
        }
        Ok(None)
    }

    /// Returns for how many vertices' room the element asks: some for itself, and some for its
    /// names.
    pub fn cost(&self) -> u64 {
        4 + self.start.attributes_raw().len() as u64 / 32
    }

    /// Says whether an attribute has one of these names, whatever its prefix.
    pub fn has(&self, names: &[&str]) -> bool {
        let attributes = self.start.attributes_raw();
        names.iter().any(|name| attributes.contains(name))
    }

    /// Returns the namespace that a prefix stands for, and its name; `None` if it is not declared.
    pub fn prefixed(&self, prefix: &str) -> Option<(Space, String)> {
        let name = format!("{prefix}:x");
        match self.resolver.resolve_attribute(QName(&name)).0 {
            ResolveResult::Bound(Namespace(name)) => Some((Space::named(name), name.into())),
            _ => None,
        }
    }
}

/// Says why a document is not well-formed, in one line: the reasons quote the document.
fn malformed(why: &impl fmt::Display) -> String {
    format!("not well-formed XML: {}", one_line(&why.to_string()))
}

/// Replaces `&amp;` and its like.
fn unescaped(value: Cow<'_, str>) -> Result<Cow<'_, str>, String> {
    if !value.contains('&') {
        return Ok(value);
    }
    let plain = quick_xml::escape::unescape(&value).map_err(|e| malformed(&e))?;
    Ok(Cow::Owned(plain.into_owned()))
}
