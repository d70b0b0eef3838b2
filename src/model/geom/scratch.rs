//! Buffers that kernels reuse from ray to ray.
//!
//! Whoever walks makes one [`Scratch`] for a batch of rays and hands it down, so that a ray
//! allocates nothing and no thread keeps hidden state. What a kernel leaves there decides
//! nothing: a new scratch gives the same answers.

use super::exact::Root;
use super::formula::SearchScratch;
use super::guarded::implicit::PolynomialScratch;

/// The buffers of all kinds of primitives that need any.
#[derive(Debug, Default)]
pub struct Scratch {
    pub polynomial: PolynomialScratch,
    /// The buffers of the search for zeros of level sets.
    pub(super) search: SearchScratch,
    /// The crossings of one line with the sides of a prism.
    pub(super) sides: Vec<Root<'static>>,
}
