//! The pipelines of the passes.

use super::layout::{MAX_HEADLIGHTS, Placement, Vertex};
use super::shaders::shader_source;
use crate::twin::render::sensor::BLOOMING_REACH;
use std::mem::{offset_of, size_of};

/// Signal in electrons; half precision keeps 11 bits, finer than the shot noise anywhere.
pub const SIGNAL: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;
/// Reversed depth.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Four grey pixels a texel.
pub const PACKED: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Four raw pixels a texel.
pub const RAW: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Uint;

/// Tunnel and bodies.
#[derive(Clone)]
pub struct Background {
    /// With their paint and the blinking of lamps.
    pub banded: wgpu::RenderPipeline,
    /// With their paint.
    pub lit: wgpu::RenderPipeline,
    /// Where it is too dark for either.
    pub dim: wgpu::RenderPipeline,
    /// What glossy surfaces mirror, times the blend constant and added.
    pub gloss: wgpu::RenderPipeline,
}

/// One pipeline a pass.
pub struct Pipelines {
    /// Tunnel and bodies under 0, 1, ... headlights, each made when first asked for.
    backgrounds: Vec<Option<Background>>,
    background: wgpu::ShaderModule,
    gloss: wgpu::ShaderModule,
    /// Mixes a share of one picture into another.
    pub blend: wgpu::RenderPipeline,
    /// Blurs along rows, and along columns.
    pub focus: [wgpu::RenderPipeline; 2],
    /// Shadows of capsules, and of any bodies, over the background.
    pub shadows: [wgpu::RenderPipeline; 2],
    /// Lamps' discs, over the background by coverage.
    pub discs: wgpu::RenderPipeline,
    /// Lamps' glare, added up.
    pub glare: wgpu::RenderPipeline,
    /// The sensor, by its [`Develop`], each made when first asked for.
    sensors: [Option<wgpu::RenderPipeline>; 4],
    sensor: wgpu::ShaderModule,
}

/// What the sensor's pass has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Develop {
    /// All bits of the converter instead of eight.
    pub raw: bool,
    /// Charge over the full well spills.
    pub blooming: bool,
}

struct Stage<'a> {
    shader: &'a wgpu::ShaderModule,
    entries: [&'a str; 2],
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    depth: Option<wgpu::DepthStencilState>,
    target: wgpu::ColorTargetState,
    constants: &'a [(&'a str, f64)],
}

impl Pipelines {
    /// Compiles all shaders.
    pub fn new(device: &wgpu::Device) -> Self {
        let shader = |name: &str| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(shader_source(name).unwrap_or_default().into()),
            })
        };
        let (lamps, glare, blend) = (shader("lamps"), shader("glare"), shader("blend"));
        let (focus, shadows) = (shader("focus"), shader("shadows"));
        let flat = |shader: &_, entries: [&str; 2], target, constants: &[(&str, f64)]| {
            flat_pipeline(device, shader, entries, target, constants)
        };
        let flags = [0.0, 1.0];
        let over = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        Self {
            backgrounds: vec![None; MAX_HEADLIGHTS + 1],
            background: shader("background"),
            gloss: shader("gloss"),
            blend: flat(&blend, ["whole", "share"], target(SIGNAL, Some(SHARE)), &[]),
            focus: flags.map(|down| {
                let target = target(SIGNAL, None);
                flat(&focus, ["whole", "focus"], target, &[("DOWN", down)])
            }),
            shadows: flags.map(|others| {
                let target = target(SIGNAL, Some(FADE));
                flat(
                    &shadows,
                    ["tile_corner", "shade"],
                    target,
                    &[("OTHERS", others)],
                )
            }),
            discs: flat(&lamps, ["disc_corner", "disc"], target(SIGNAL, over), &[]),
            glare: flat(&glare, ["glare_corner", "glare"], target(SIGNAL, over), &[]),
            sensors: [const { None }; 4],
            sensor: shader("sensor"),
        }
    }

    /// The pipeline that draws tunnel and bodies under so many headlights.
    pub fn background(&mut self, device: &wgpu::Device, headlights: usize) -> &Background {
        let headlights = headlights.min(MAX_HEADLIGHTS);
        self.backgrounds[headlights].get_or_insert_with(|| {
            let make = |kind, banded| {
                let constants = [
                    ("HEADLIGHTS", headlights as f64),
                    ("BANDED", f64::from(u8::from(banded))),
                ];
                surface(device, &self.background, kind, &constants, false)
            };
            let headlights = [("HEADLIGHTS", headlights as f64)];
            Background {
                banded: make("lit", true),
                lit: make("lit", false),
                dim: make("dim", false),
                gloss: surface(device, &self.gloss, "gloss", &headlights, true),
            }
        })
    }

    /// The pipeline that develops a picture.
    pub fn sensor(&mut self, device: &wgpu::Device, develop: Develop) -> &wgpu::RenderPipeline {
        let at = usize::from(develop.raw) + 2 * usize::from(develop.blooming);
        self.sensors[at].get_or_insert_with(|| {
            let (entry, format) = if develop.raw {
                ("develop_raw", RAW)
            } else {
                ("develop", PACKED)
            };
            let reach = if develop.blooming { BLOOMING_REACH } else { 0 };
            let reach = [("BLOOMING_REACH", reach as f64)];
            let target = target(format, None);
            flat_pipeline(device, &self.sensor, ["whole", entry], target, &reach)
        })
    }
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
        target,
        constants,
    };
    pipeline(device, stage)
}

/// Draws surfaces into the depth buffer, or adds to those that are there.
fn surface(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    kind: &str,
    constants: &[(&str, f64)],
    adds: bool,
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
        depth: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(!adds),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            // The same surface again must not be behind itself by a rounding.
            bias: wgpu::DepthBiasState {
                constant: if adds { 16 } else { 0 },
                slope_scale: if adds { 0.01 } else { 0.0 },
                clamp: 0.0,
            },
        }),
        target: target(SIGNAL, adds.then_some(ADD)),
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

const fn attribute(
    format: wgpu::VertexFormat,
    offset: usize,
    shader_location: u32,
) -> wgpu::VertexAttribute {
    wgpu::VertexAttribute {
        format,
        offset: offset as u64,
        shader_location,
    }
}

const VERTEX: [wgpu::VertexAttribute; 8] = {
    use wgpu::VertexFormat::{Float32, Float32x2, Float32x3};
    [
        attribute(Float32x3, offset_of!(Vertex, position_m), 0),
        attribute(Float32x3, offset_of!(Vertex, normal), 1),
        attribute(Float32x2, offset_of!(Vertex, light_lx), 2),
        attribute(Float32x2, offset_of!(Vertex, place_m), 3),
        attribute(Float32, offset_of!(Vertex, paint), 4),
        attribute(Float32, offset_of!(Vertex, albedo), 5),
        attribute(Float32, offset_of!(Vertex, luminance_cd_m2), 6),
        attribute(Float32x3, offset_of!(Vertex, gloss), 13),
    ]
};

const PLACEMENT: [wgpu::VertexAttribute; 7] = {
    use wgpu::VertexFormat::{Float32, Float32x2, Float32x3, Uint32};
    [
        attribute(Float32x3, offset_of!(Placement, offset_m), 7),
        attribute(Float32, offset_of!(Placement, period_share), 8),
        attribute(Float32x3, offset_of!(Placement, velocity_mps), 9),
        attribute(Float32, offset_of!(Placement, late_s), 10),
        attribute(Uint32, offset_of!(Placement, shares), 11),
        attribute(Float32x2, offset_of!(Placement, paint_per_m), 12),
        attribute(Float32x3, offset_of!(Placement, along), 14),
    ]
};

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
            targets: &[Some(stage.target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
