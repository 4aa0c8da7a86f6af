//! From a scene to an organized cloud with its truth.

use crate::shapes::Shape;
use crate::vector::{Vector, dot, scale};

/// A pinhole camera at the origin that looks along z.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal length in pixels.
    pub focal: f64,
    /// The principal point in pixels; 0 is the middle of the first pixel.
    pub center: [f64; 2],
}

impl Default for Camera {
    /// A Kinect: 640x480, f = 525.
    fn default() -> Self {
        Camera::with_size(640, 480)
    }
}

impl Camera {
    /// A camera with a Kinect's horizontal field of view.
    pub fn with_size(width: usize, height: usize) -> Self {
        let center = [(width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0];
        Camera { width, height, focal: 525.0 * width as f64 / 640.0, center }
    }

    /// The ray of an image position, with z = 1.
    pub fn ray(&self, x: f64, y: f64) -> Vector {
        [(x - self.center[0]) / self.focal, (y - self.center[1]) / self.focal, 1.0]
    }
}

/// The surface number of pixels that see nothing.
pub const NO_SURFACE: u16 = u16::MAX;

/// Shapes to look at. Every smooth part of a shape is a surface of its own, numbered in the shapes' order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The shapes.
    pub shapes: Vec<Shape>,
}

/// What one ray sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub z: f64,
    pub normal: Vector,
    pub surface: u16,
}

impl Scene {
    /// What the ray (with z = 1) sees; the normal has unit length and faces the camera.
    pub(crate) fn look(&self, ray: Vector) -> Option<Sight> {
        let mut nearest: Option<Sight> = None;
        let mut first = 0;
        for shape in &self.shapes {
            if let Some(hit) = shape.hit(ray)
                && nearest.is_none_or(|sight| hit.t < sight.z)
            {
                let sign = if dot(hit.normal, ray) > 0.0 { -1.0 } else { 1.0 };
                let normal = scale(hit.normal, sign);
                nearest = Some(Sight { z: hit.t, normal, surface: first + hit.part });
            }
            first += shape.parts();
        }
        nearest
    }

    /// The exact organized cloud that the camera sees.
    pub fn render(&self, camera: &Camera) -> Frame {
        self.render_by(camera, |_, ray| self.look(ray))
    }

    /// The organized cloud of what `look` gives for each pixel's column and row, and its ray.
    pub(crate) fn render_by(
        &self,
        camera: &Camera,
        mut look: impl FnMut([usize; 2], Vector) -> Option<Sight>,
    ) -> Frame {
        let pixels = camera.width * camera.height;
        let mut frame = Frame {
            scene: self.clone(),
            camera: camera.clone(),
            points: Vec::with_capacity(pixels),
            normals: Vec::with_capacity(pixels),
            surfaces: Vec::with_capacity(pixels),
        };
        for y in 0..camera.height {
            for x in 0..camera.width {
                let ray = camera.ray(x as f64, y as f64);
                frame.push(ray, look([x, y], ray));
            }
        }
        frame
    }
}

/// An organized cloud with its truth, row by row.
#[derive(Clone, Debug)]
pub struct Frame {
    /// What was looked at.
    pub scene: Scene,
    /// The camera.
    pub camera: Camera,
    /// The points; NaN where there is none.
    pub points: Vec<[f32; 3]>,
    /// The true unit normal of what each pixel saw, facing the camera; NaN where it saw nothing.
    pub normals: Vec<[f32; 3]>,
    /// The surface that each pixel saw, or [`NO_SURFACE`].
    pub surfaces: Vec<u16>,
}

impl Frame {
    fn push(&mut self, ray: Vector, sight: Option<Sight>) {
        let (point, normal, surface) = match sight {
            Some(Sight { z, normal, surface }) => (scale(ray, z), normal, surface),
            None => ([f64::NAN; 3], [f64::NAN; 3], NO_SURFACE),
        };
        self.points.push(point.map(|c| c as f32));
        self.normals.push(normal.map(|c| c as f32));
        self.surfaces.push(surface);
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.camera.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.camera.height
    }
}
