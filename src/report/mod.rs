//! What a result looks like: plots, pictures, tables and the page that gathers them (the thesis' figures 8.9 to 8.11
//! are the models). Plots and pictures take plain numbers and surfaces, so that any stage may use them, and give bytes
//! that depend on nothing but those: the same result makes the same page.
//!
//! Rooms: [`colour`] (palettes that survive colour blindness), [`ticks`] (round numbers on axes), [`svg`] (the drawing
//! that plots and pictures end in), [`plot`] and [`bars`] (curves and errors), [`raster`] (triangles to pixels without
//! a graphics card), [`shading`] (their normals, light and outlines), [`picture`] (an object cut open, a quantity on a
//! surface), [`legend`] (what its colours mean), [`layouts`] (the rows that page and terminal share), [`page`] and
//! `style` (the HTML page), [`table`] and [`terminal_plot`] (the terminal), [`replicate`] (the page of a search), [`reach`] and [`pareto`] (its sections on what is out of reach and
//! on error against mass and cost),
//! [`fit_probe`] (the page of a fit to presses); of coupon fits [`coupon_plots`], [`coupon_table`] and [`coupon_page`]; of the
//! materials [`database`], [`database_curve`] and [`database_page`].

pub mod bars;
pub mod colour;
pub mod coupon_page;
pub mod coupon_plots;
pub mod coupon_table;
pub mod database;
pub mod database_curve;
pub mod database_page;
pub mod fit_probe;
pub mod layouts;
pub mod legend;
pub mod page;
pub mod pareto;
pub mod picture;
pub mod plot;
pub mod raster;
pub mod reach;
pub mod replicate;
pub mod shading;
pub mod svg;
pub mod table;
pub mod terminal_plot;
pub mod ticks;

mod style;
