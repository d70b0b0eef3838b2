//! The built command, from outside: exit codes, messages, files.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod batch;
mod batch_messages;
mod bench;
mod commands;
mod compare;
mod convert;
mod datasets;
mod display;
mod every_scene;
mod extremes;
mod farms;
mod found;
mod kept_light;
mod layers;
mod malformed;
mod manners;
mod measure;
mod motion;
mod outputs;
mod parts;
mod placed;
mod placed_cameras;
mod roots;
mod run;
mod scad;
mod sequences;
mod shutters;
mod solids;
mod solvers;
mod stdin;
mod surfaces;
mod thumbs;
mod tiles;
mod tradeoff;
mod verify;
mod view;
mod views;
mod written;
