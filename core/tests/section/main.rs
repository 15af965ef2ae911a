//! Sections from shapes, against closed forms, published numbers and other codes.

mod fuzz;
mod known;
mod reference;
