//! The outputs that a picture may have beside its colour, by name.

/// A set of arbitrary output variables (AOVs) to keep beside the colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovSet {
    pub depth: bool,
    pub position: bool,
    pub normal: bool,
    pub albedo: bool,
    pub instance_id: bool,
    pub primitive_id: bool,
    pub samples: bool,
    pub distance: bool,
    pub geometric_normal: bool,
    pub camera_normal: bool,
    pub uv: bool,
    /// Motion vectors as Blender has them, and as Nuke has them; what makes them asks for hits.
    pub vector: bool,
    pub motion: bool,
    pub variance: bool,
    pub diffuse_direct: bool,
    pub diffuse_indirect: bool,
    pub specular_direct: bool,
    pub specular_indirect: bool,
    pub emission: bool,
    pub environment: bool,
    /// A layer for each group of lights.
    pub light_groups: bool,
    /// Cryptomattes of shapes, materials and instances.
    pub crypto_object: bool,
    pub crypto_material: bool,
    pub crypto_instance: bool,
    /// A denoiser's guides: what samples meet first behind mirrors and smooth glass.
    pub denoising_albedo: bool,
    pub denoising_normal: bool,
}

impl AovSet {
    /// The set without AOVs.
    pub const NONE: AovSet = AovSet {
        depth: false,
        position: false,
        normal: false,
        albedo: false,
        instance_id: false,
        primitive_id: false,
        samples: false,
        distance: false,
        geometric_normal: false,
        camera_normal: false,
        uv: false,
        vector: false,
        motion: false,
        variance: false,
        diffuse_direct: false,
        diffuse_indirect: false,
        specular_direct: false,
        specular_indirect: false,
        emission: false,
        environment: false,
        light_groups: false,
        crypto_object: false,
        crypto_material: false,
        crypto_instance: false,
        denoising_albedo: false,
        denoising_normal: false,
    };

    /// Whether the set has an AOV.
    pub fn any(&self) -> bool {
        *self != AovSet::default()
    }

    /// Whether the set has an AOV that the pixels' first hits tell.
    pub fn any_of_hits(&self) -> bool {
        self.depth
            || self.position
            || self.normal
            || self.albedo
            || self.instance_id
            || self.primitive_id
            || self.distance
            || self.geometric_normal
            || self.camera_normal
            || self.uv
    }

    /// Says which of the layers of the light's way are in the set, in the order of
    /// their names.
    pub fn light_layers(&self) -> [bool; 6] {
        [
            self.diffuse_direct,
            self.diffuse_indirect,
            self.specular_direct,
            self.specular_indirect,
            self.emission,
            self.environment,
        ]
    }

    /// Whether the set has a layer of light, or of groups of lights.
    pub fn any_of_light(&self) -> bool {
        self.light_groups || self.light_layers().contains(&true)
    }

    /// Whether the set has motion vectors.
    pub fn any_of_motion(&self) -> bool {
        self.vector || self.motion
    }

    /// Says which of a denoiser's guides are in the set, in the order of their names.
    pub fn guides(&self) -> [bool; 2] {
        [self.denoising_albedo, self.denoising_normal]
    }

    /// Whether the set has a guide of a denoiser.
    pub fn any_of_guides(&self) -> bool {
        self.guides().contains(&true)
    }

    /// Whether the set has an output beyond colour, depth, position, normal, albedo, ids and
    /// samples.
    pub fn any_of_layers(&self) -> bool {
        let plain = AovSet {
            depth: self.depth,
            position: self.position,
            normal: self.normal,
            albedo: self.albedo,
            instance_id: self.instance_id,
            primitive_id: self.primitive_id,
            samples: self.samples,
            ..AovSet::default()
        };
        *self != plain
    }

    /// Whether the set has a Cryptomatte.
    pub fn any_of_mattes(&self) -> bool {
        self.crypto_object || self.crypto_material || self.crypto_instance
    }

    /// Lists the AOVs of the set that only paths have.
    pub fn of_paths(&self) -> Vec<&'static str> {
        let paths = AovSet::NAMES.into_iter().skip(AovSet::FIRST_OF_PATHS);
        paths
            .filter(|name| {
                let mut with = *self;
                with.add(name);
                with == *self
            })
            .collect()
    }

    /// Returns the set with these outputs besides, of [`AovSet::NAMES`].
    pub fn with(mut self, names: &[&str]) -> AovSet {
        for name in names {
            self.add(name);
        }
        self
    }

    /// Adds all AOVs that a picture can have; those of paths only if it is one.
    pub fn add_all(&mut self, paths: bool) {
        let last = match paths {
            true => AovSet::NAMES.len(),
            false => AovSet::FIRST_OF_PATHS,
        };
        *self = self.with(&AovSet::NAMES[..last]);
    }

    /// The first of the names that only paths have.
    const FIRST_OF_PATHS: usize = 13;

    /// The names of the AOVs, as `--aov` takes them.
    pub const NAMES: [&str; 26] = [
        "depth",
        "position",
        "normal",
        "albedo",
        "instance_id",
        "primitive_id",
        "samples",
        "distance",
        "geometric_normal",
        "camera_normal",
        "uv",
        "vector",
        "motion",
        "variance",
        "diffuse_direct",
        "diffuse_indirect",
        "specular_direct",
        "specular_indirect",
        "emission",
        "environment",
        "light_groups",
        "crypto_object",
        "crypto_material",
        "crypto_instance",
        "denoising_albedo",
        "denoising_normal",
    ];

    /// Adds the AOV called `name`; returns false if there is none of this name.
    pub fn add(&mut self, name: &str) -> bool {
        let one = match name {
            "depth" => &mut self.depth,
            "position" => &mut self.position,
            "normal" => &mut self.normal,
            "albedo" => &mut self.albedo,
            "instance_id" => &mut self.instance_id,
            "primitive_id" => &mut self.primitive_id,
            "samples" => &mut self.samples,
            "distance" => &mut self.distance,
            "geometric_normal" => &mut self.geometric_normal,
            "camera_normal" => &mut self.camera_normal,
            "uv" => &mut self.uv,
            "vector" => &mut self.vector,
            "motion" => &mut self.motion,
            "variance" => &mut self.variance,
            "diffuse_direct" => &mut self.diffuse_direct,
            "diffuse_indirect" => &mut self.diffuse_indirect,
            "specular_direct" => &mut self.specular_direct,
            "specular_indirect" => &mut self.specular_indirect,
            "emission" => &mut self.emission,
            "environment" => &mut self.environment,
            "light_groups" => &mut self.light_groups,
            "crypto_object" => &mut self.crypto_object,
            "crypto_material" => &mut self.crypto_material,
            "crypto_instance" => &mut self.crypto_instance,
            "denoising_albedo" => &mut self.denoising_albedo,
            "denoising_normal" => &mut self.denoising_normal,
            _ => return false,
        };
        *one = true;
        true
    }
}
