//! The baseline of a build without Embree: the same interface, with types that have no
//! values.

use super::{BaselineError, BaselineTests};
use crate::clock::Clock;
use crate::index_stats::StructureRow;
use crate::queries::{Answers, Ask};
use lanecast_io::{RaySet, TriangleSet};
use lanecast_picture::render::Progress;

pub enum Embree {}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {}

impl Embree {
    pub fn new(
        _: &TriangleSet,
        _: &[BaselineTests],
        _threads: usize,
    ) -> Result<Embree, BaselineError> {
        Err(BaselineError::NotBuilt)
    }

    pub fn build(&mut self, _: Clock) -> Result<(), BaselineError> {
        match *self {}
    }

    pub fn index_stats(&self) -> Vec<StructureRow> {
        match *self {}
    }

    pub fn ways(&self, _: BaselineTests) -> Vec<Way> {
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
