//! `view`: who is let in, and what a page is told and shown.

#[cfg(feature = "view")]
mod pages;

#[cfg(not(feature = "view"))]
#[test]
fn a_program_without_the_viewer_says_how_to_get_one() {
    crate::run::fails(&["view"], 2, "--features view");
}
