//! Charcloth simulates the burning of thin deformable sheets: paper and cloth that shrink, curl, tear and flake.
//!
//! The modules in reading order: a [`scene`] says what to simulate; [`build`] makes the state of it; [`simulation`] has
//! the step, which is the table of contents of the physics; [`frame`] is what comes out.
//!
//! ```
//! use charcloth::frame::Null;
//! use charcloth::scene::{Corner, Ignite, Scene};
//! use charcloth::simulation::{Inputs, Simulation};
//! use charcloth::units::Length;
//!
//! let mut scene = Scene::default();
//! scene.sheet.spacing = Length(0.02);
//! scene.ignite.push(Ignite { corner: Some(Corner::BottomRight), radius: Length(0.03), ..Ignite::default() });
//! let mut simulation = Simulation::build(&scene, &Inputs::default())?;
//! simulation.run(3, &mut Null)?;
//! assert!(simulation.summary().fuel_burnt_kg > 0.0);
//! assert!(simulation.summary().mass_error < 1e-12);
//! # Ok::<(), charcloth::error::Error>(())
//! ```

pub mod scene;
pub mod units;

pub mod build;
pub mod burn_mesh;
pub mod fields;
pub mod generate;
pub mod layout;
pub mod material;
pub mod mesh;
pub mod motion;
pub mod noise;
pub mod ragged;
pub mod random;
pub mod select;
pub mod sheet;

pub mod chemistry;
pub mod contact;
pub mod crack;
pub mod effects;
pub mod flow;
pub mod gases;
pub mod homogenise;
pub mod integrators;
pub mod kernels;
pub mod particles;
pub mod physical;
pub mod plume;
pub mod shell;
pub mod simulation;
pub mod solver;
pub mod substances;
pub mod tear;
pub mod thermo;

pub mod check;
pub mod counters;
pub mod error;
pub mod frame;
pub mod ledger;
pub mod measure;
pub mod registry;
pub mod tongues;
