//! //! The baseline of a build without Embree: the same interface, with types that have
//! no values.

use super::{PeerError, PeerTests};
use crate::io::{RaySet, TriangleSet};
use crate::measure::clock::Clock;
use crate::measure::queries::{Answers, Ask};
use crate::measure::structures::StructureRow;
use crate::render::Progress;

pub enum Embree {}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {}

impl Embree {
    pub fn new(_: &TriangleSet, _: &[PeerTests], _threads: usize) -> Result<Embree, PeerError> {
        Err(PeerError::NotBuilt)
    }

    pub fn build(&mut self, _: Clock) -> Result<(), PeerError> {
        match *self {}
    }

    pub fn structures(&self) -> Vec<StructureRow> {
        match *self {}
    }

    pub fn ways(&self, _: PeerTests) -> Vec<Way> {
        match *self {}
    }

    pub fn name(&self, way: Way, _: Ask) -> String {
        match way {}
    }

    pub fn isa(&self, way: Way) -> &'static str {
        match way {}
    }

    pub fn trace(&self, way: Way, _: &RaySet, _: Ask, _: &mut Answers, _: &Progress) -> Option<()> {
        match way {}
    }
}

impl Way {
    pub fn lanes(self) -> usize {
        match self {}
    }
}
