//! Tables that several scenes share: copies of one scene at different times differ in their
//! transforms, and not in their meshes.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// Shares a table between clones. It is copied when a clone writes to it.
#[derive(Clone, Default)]
pub struct Shared<T>(Arc<T>);

impl<T> Deref for Shared<T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Clone> DerefMut for Shared<T> {
    fn deref_mut(&mut self) -> &mut T {
        Arc::make_mut(&mut self.0)
    }
}

impl<T> From<T> for Shared<T> {
    fn from(table: T) -> Shared<T> {
        Shared(Arc::new(table))
    }
}

/// Shows the table alone.
impl<T: fmt::Debug> fmt::Debug for Shared<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.fmt(f)
    }
}
