//! The pipelines of the passes.

use super::layout::{Placement, Vertex};
use super::shaders::shader_source;
use crate::twin::render::sensor::BLOOMING_REACH;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::mem::size_of;

/// Signal in electrons; half precision keeps 11 bits, finer than the shot noise anywhere.
pub const SIGNAL: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;
/// Reversed depth.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Four pixels of the finished image a texel.
pub const RAW: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Uint;

/// Steady and blinking light of a tunnel that is kept.
pub const LIGHT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;
/// Whose blinking it is: a row of the table of shares.
pub const LAMP: wgpu::TextureFormat = wgpu::TextureFormat::R16Uint;

/// What a pipeline draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Tunnel and bodies under so many headlights; whether the blinking of lamps shows, and whether paint is
    /// smeared.
    Lit {
        headlights: usize,
        banded: bool,
        smeared: bool,
    },
    /// A kept tunnel once more, under headlights: only where its depth is the kept one.
    Relit { headlights: usize, banded: bool },
    /// Steady and blinking light of the tunnel apart, without headlights.
    Split,
    /// What glossy surfaces mirror, times the blend constant and added.
    Gloss { headlights: usize },
    /// Nothing, in parts of the picture.
    Clear,
    /// Mixes a share of one picture into another.
    Blend,
    /// Blurs along columns, or else along rows.
    Focus { down: bool },
    /// Shadows of any bodies, or else of capsules, over the background.
    Shadows { others: bool },
    /// Lamps' discs, over the background by coverage.
    Discs,
    /// Lamps' glare, added up.
    Glare,
    /// The sensor, where charge over the full well spills or does not.
    Sensor { blooming: bool },
}

impl Kind {
    /// The shader that it is in.
    fn shader(self) -> &'static str {
        match self {
            Self::Lit { .. } | Self::Relit { .. } | Self::Split => "background",
            Self::Gloss { .. } => "gloss",
            Self::Clear => "clear",
            Self::Blend => "blend",
            Self::Focus { .. } => "focus",
            Self::Shadows { .. } => "shadows",
            Self::Discs => "lamps",
            Self::Glare => "glare",
            Self::Sensor { .. } => "sensor",
        }
    }
}

/// Pipelines and shaders, each made when first asked for: a software adapter takes long for them, and keeps
/// megabytes of each.
#[derive(Default)]
pub struct Pipelines {
    made: RefCell<BTreeMap<Kind, wgpu::RenderPipeline>>,
    shaders: RefCell<BTreeMap<&'static str, wgpu::ShaderModule>>,
}

struct Stage<'a> {
    shader: &'a wgpu::ShaderModule,
    entries: [&'a str; 2],
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    depth: Option<wgpu::DepthStencilState>,
    targets: &'a [wgpu::ColorTargetState],
    constants: &'a [(&'a str, f64)],
}

impl Pipelines {
    /// The pipeline of a kind.
    pub fn get(&self, device: &wgpu::Device, kind: Kind) -> wgpu::RenderPipeline {
        let mut made = self.made.borrow_mut();
        let pipeline = made.entry(kind).or_insert_with(|| self.make(device, kind));
        pipeline.clone()
    }

    fn shader(&self, device: &wgpu::Device, name: &'static str) -> wgpu::ShaderModule {
        let make = || {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(shader_source(name).unwrap_or_default().into()),
            })
        };
        let mut shaders = self.shaders.borrow_mut();
        shaders.entry(name).or_insert_with(make).clone()
    }

    fn make(&self, device: &wgpu::Device, kind: Kind) -> wgpu::RenderPipeline {
        let shader = self.shader(device, kind.shader());
        let over = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        let signal = |blend| target(SIGNAL, blend);
        let flag = |name, set| [(name, f64::from(u8::from(set)))];
        let flat = |entries, target, constants: &[_]| {
            flat_pipeline(device, &shader, entries, target, constants)
        };
        let surface = |entries, constants: &[_], targets: &[_], depth| {
            surface(device, (&shader, entries), constants, targets, depth)
        };
        match kind {
            Kind::Lit {
                headlights,
                banded,
                smeared,
            } => {
                let constants = lighting(headlights, banded, smeared);
                surface("lit", &constants, &[signal(None)], drawn_depth())
            }
            Kind::Relit { headlights, banded } => {
                let constants = lighting(headlights, banded, false);
                let same = depths(false, wgpu::CompareFunction::Equal);
                surface("lit", &constants, &[signal(None)], same)
            }
            Kind::Split => {
                let targets = [target(LIGHT, None), target(LAMP, None)];
                surface("split", &[], &targets, drawn_depth())
            }
            Kind::Gloss { headlights } => {
                let constants = [("HEADLIGHTS", headlights as f64)];
                surface("gloss", &constants, &[signal(Some(ADD))], added_depth())
            }
            Kind::Clear => clearing(device, &shader),
            Kind::Blend => flat(["whole", "share"], signal(Some(SHARE)), &[]),
            Kind::Focus { down } => flat(["whole", "focus"], signal(None), &flag("DOWN", down)),
            Kind::Shadows { others } => {
                let constants = flag("OTHERS", others);
                flat(["tile_corner", "shade"], signal(Some(FADE)), &constants)
            }
            Kind::Discs => flat(["disc_corner", "disc"], signal(over), &[]),
            Kind::Glare => flat(["glare_corner", "glare"], signal(over), &[]),
            Kind::Sensor { blooming } => {
                let reach = if blooming { BLOOMING_REACH } else { 0 };
                let constants = [("BLOOMING_REACH", reach as f64)];
                flat(["whole", "develop"], target(RAW, None), &constants)
            }
        }
    }
}

/// The constants of a background.
fn lighting(headlights: usize, banded: bool, smeared: bool) -> [(&'static str, f64); 3] {
    let flag = |set| f64::from(u8::from(set));
    [
        ("HEADLIGHTS", headlights as f64),
        ("BANDED", flag(banded)),
        ("SMEARED", flag(smeared)),
    ]
}

/// Draws rectangles, without buffers or depth.
fn flat_pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    entries: [&str; 2],
    target: wgpu::ColorTargetState,
    constants: &[(&str, f64)],
) -> wgpu::RenderPipeline {
    let stage = Stage {
        shader,
        entries,
        buffers: &[],
        depth: None,
        targets: &[target],
        constants,
    };
    pipeline(device, stage)
}

/// Draws rectangles over whatever is there, depths too.
fn clearing(device: &wgpu::Device, shader: &wgpu::ShaderModule) -> wgpu::RenderPipeline {
    let stage = Stage {
        shader,
        entries: ["part_corner", "clear"],
        buffers: &[],
        depth: Some(depths(true, wgpu::CompareFunction::Always)),
        targets: &[target(SIGNAL, None)],
        constants: &[],
    };
    pipeline(device, stage)
}

fn depths(written: bool, compare: wgpu::CompareFunction) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(written),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

/// Of surfaces that hide each other.
fn drawn_depth() -> wgpu::DepthStencilState {
    depths(true, wgpu::CompareFunction::Greater)
}

/// Of surfaces that are added to what was drawn: they must not be behind themselves by a rounding.
fn added_depth() -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        bias: wgpu::DepthBiasState {
            constant: 16,
            slope_scale: 0.01,
            clamp: 0.0,
        },
        ..depths(false, wgpu::CompareFunction::Greater)
    }
}

/// Draws surfaces as a shader's two entries for a kind of light do.
fn surface(
    device: &wgpu::Device,
    (shader, kind): (&wgpu::ShaderModule, &str),
    constants: &[(&str, f64)],
    targets: &[wgpu::ColorTargetState],
    depth: wgpu::DepthStencilState,
) -> wgpu::RenderPipeline {
    let entries = [format!("project_{kind}"), format!("shade_{kind}")];
    let layout = |stride, step_mode, attributes| {
        Some(wgpu::VertexBufferLayout {
            array_stride: stride as u64,
            step_mode,
            attributes,
        })
    };
    let stage = Stage {
        shader,
        entries: [&entries[0], &entries[1]],
        buffers: &[
            layout(size_of::<Vertex>(), wgpu::VertexStepMode::Vertex, &VERTEX),
            layout(
                size_of::<Placement>(),
                wgpu::VertexStepMode::Instance,
                &PLACEMENT,
            ),
        ],
        depth: Some(depth),
        targets,
        constants,
    };
    pipeline(device, stage)
}

/// The source's share is the blend constant, the rest is what was there.
const SHARE: wgpu::BlendState = sum_of(
    wgpu::BlendFactor::Constant,
    wgpu::BlendFactor::OneMinusConstant,
);
/// Adds the source times the blend constant.
const ADD: wgpu::BlendState = sum_of(wgpu::BlendFactor::Constant, wgpu::BlendFactor::One);
/// Keeps the share in the alpha of what is there, and adds the source.
const FADE: wgpu::BlendState = sum_of(wgpu::BlendFactor::One, wgpu::BlendFactor::SrcAlpha);

const fn sum_of(src_factor: wgpu::BlendFactor, dst_factor: wgpu::BlendFactor) -> wgpu::BlendState {
    let sum = wgpu::BlendComponent {
        src_factor,
        dst_factor,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState {
        color: sum,
        alpha: sum,
    }
}

/// The members of [`Vertex`] that shaders read, one after the other.
const VERTEX: [wgpu::VertexAttribute; 7] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32x3, 2 => Float32x2, 3 => Float32x2, 4 => Float32, 6 => Float32,
    13 => Float32x3
];

/// Those of [`Placement`].
const PLACEMENT: [wgpu::VertexAttribute; 8] = wgpu::vertex_attr_array![
    7 => Float32x3, 8 => Float32, 9 => Float32x3, 10 => Float32, 11 => Uint32, 12 => Float32x2,
    14 => Float32x3, 15 => Float32
];

fn target(format: wgpu::TextureFormat, blend: Option<wgpu::BlendState>) -> wgpu::ColorTargetState {
    wgpu::ColorTargetState {
        format,
        blend,
        write_mask: wgpu::ColorWrites::ALL,
    }
}

fn pipeline(device: &wgpu::Device, stage: Stage<'_>) -> wgpu::RenderPipeline {
    let options = wgpu::PipelineCompilationOptions {
        constants: stage.constants,
        ..Default::default()
    };
    let targets: Vec<_> = stage.targets.iter().cloned().map(Some).collect();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(stage.entries[1]),
        layout: None,
        vertex: wgpu::VertexState {
            module: stage.shader,
            entry_point: Some(stage.entries[0]),
            compilation_options: options.clone(),
            buffers: stage.buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: stage.depth,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: stage.shader,
            entry_point: Some(stage.entries[1]),
            compilation_options: options,
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
