// What the ultrasound passes and the C++ side share: the constants of the image model, each with its source, and the
// structures that cross over to the GPU (std430). Included by GLSL and by C++.
//
// Amplitudes are relative to the mean-square speckle amplitude of normal liver, which is 1. Lengths are metres.
#ifdef __cplusplus
#pragma once
#include <cstdint>
namespace stylet::ultrasound {
using uint = std::uint32_t;
/// Four floats as std430 lays them out.
struct vec4 {
  float x, y, z, w;
};
#define STYLET_SHARED constexpr
#define STYLET_UNIFORM alignas(16)  // std140 rounds a structure up to 16 bytes
#else
#define STYLET_SHARED const
#define STYLET_UNIFORM
#endif

// ---- media that are no tissue of the scene -------------------------------------------------------------------------
STYLET_SHARED float kAirImpedance = 429.0f;      // Pa s/m at 20 C: 1.2 kg/m^3 * 343 m/s * ~1.04; Kinsler, Fundamentals of Acoustics
STYLET_SHARED float kAirAttenuation = 12.0f;     // dB/cm/MHz, bowel gas as an image sees it: nothing comes back
STYLET_SHARED float kGelImpedance = 1.50e6f;     // coupling gel is water-like: 1.48-1.52 MRayl
STYLET_SHARED float kGelAttenuation = 0.05f;     // dB/cm/MHz
STYLET_SHARED float kNoBackscatterDb = -90.0f;   // gel and air hold no scatterers
STYLET_SHARED float kCouplingDepth = 0.018f;    // m before the skin that gel bridges: a pressed skin follows the face, ours is rigid to it
STYLET_SHARED float kGelFilm = 0.004f;          // m that it bridges once the probe has left the skin
STYLET_SHARED float kDryGap = 0.0015f;          // m without gel: what the voxels of the skin are unsure of
STYLET_SHARED float kFillerBackscatterDb = -7.0f;   // fat around an organ, where the organ has moved away: as subcutaneous fat
STYLET_SHARED float kFillerImpedance = 1.38e6f;     // fat, Pa s/m; Goss, Johnston, Dunn, JASA 64 (1978)
STYLET_SHARED float kFillerAttenuation = 0.63f;     // dB/cm/MHz, fat; Duck, Physical Properties of Tissue (1990)

// ---- pulse and beam: full widths at half maximum of the amplitude ---------------------------------------------------
STYLET_SHARED float kAxialFwhm0 = 0.50e-3f;      // 2.3 cycles at 3.5 MHz: n lambda / 2
STYLET_SHARED float kAxialFwhmSlope = 1.8e-3f;   // m per m: the pulse loses its high frequencies with depth
STYLET_SHARED float kLateralLambdas = 1.15f;     // lateral width = 1.15 lambda F#, between 1 and 1.2 for usual apodisation
STYLET_SHARED float kMinFNumber = 2.2f;          // of a convex array; aperture grows with depth at the probe's F# ...
STYLET_SHARED float kMaxAperture = 0.038f;       // ... until the array is used up
STYLET_SHARED float kLateralFocus = 0.075f;      // transmit focus and the depth of field around it
STYLET_SHARED float kLateralFieldDepth = 0.090f; // at kMinFNumber; it goes with the square of F#
STYLET_SHARED float kLateralDefocus = 0.35f;
// The slice of the probe that the next ones and the speckle field are made for; of a finer one they are as much finer.
STYLET_SHARED float kElevationFwhm = 3.0e-3f;    // fixed lens of a convex abdominal array: 2.5-4 mm at its focus
STYLET_SHARED float kElevationFieldDepth = 0.055f;
STYLET_SHARED int kMaxPlanes = 13;               // sub-planes summed across the slice thickness, an odd number
STYLET_SHARED float kElevationReach = 2.2f;      // standard deviations that they cover on either side ...
STYLET_SHARED float kElevationSpacing = 0.55e-3f;   // ... but at the focus never further apart, m: the speckle between would decorrelate ...
STYLET_SHARED float kMostElevationSpacing = 0.70e-3f;  // ... and nowhere further than this
STYLET_SHARED int kElevationRow = 8;             // of a depth: weights of the planes from the centre out, then their spacing
STYLET_SHARED int kLateralTaps = 11;             // taps on one side, centre included
STYLET_SHARED int kAxialTaps = 5;

STYLET_SHARED int kTissueRows = 256;             // tissues of a scene, gel and filler
STYLET_SHARED int kPixels = 32;                  // of a row of the picture, done together
STYLET_SHARED int kBlock = 4;                    // lines, or samples, that one invocation of a filter makes
STYLET_SHARED int kTile = 8;                     // lines, and samples, of a tile: it lists the tetrahedra that may cover it
STYLET_SHARED float kInsideTet = -1e-4f;         // a point on a face must be found on one side whatever the rounding

// ---- speckle: complex circular Gaussian in rest space (Wagner et al., IEEE Trans. Sonics Ultrason. 30, 1983) ------------
STYLET_SHARED int kSpeckleSize = 64;             // texels a side of the box of a look: 512 KiB, which caches hold. Boxes of it
                                                 // fill space, each shifted by a random number of texels: no two are alike
STYLET_SHARED uint kSpeckleTexels = 262144u;     // kSpeckleSize^3
STYLET_SHARED int kSlowSize = 128;               // texels along x and y of the slow fields, periodic ...
STYLET_SHARED int kSlowDepth = 64;               // ... and along z
STYLET_SHARED float kTextureFwhm = 2.6e-3f;      // widths of their autocorrelation: brightness of the parenchyma ...
STYLET_SHARED float kBeadFwhm = 1.9e-3f;         // ... and along interfaces
STYLET_SHARED int kTexelBits = 20;
STYLET_SHARED uint kSlowTexels = 1048576u;       // kSlowSize^2 kSlowDepth = 2^kTexelBits
STYLET_SHARED float kSpeckleSpacing = 0.14e-3f;
// Rotation from rest space to the speckle lattice, by odd angles, so that its period never lies in the image plane.
STYLET_SHARED float kSpeckleX0 = -0.24499837f;  STYLET_SHARED float kSpeckleX1 = -0.92956370f;  STYLET_SHARED float kSpeckleX2 = 0.27547620f;
STYLET_SHARED float kSpeckleY0 = 0.89586691f;  STYLET_SHARED float kSpeckleY1 = -0.32568676f;  STYLET_SHARED float kSpeckleY2 = -0.30224264f;
STYLET_SHARED float kSpeckleZ0 = 0.37067274f;  STYLET_SHARED float kSpeckleZ1 = 0.17274105f;  STYLET_SHARED float kSpeckleZ2 = 0.91255808f;
STYLET_SHARED float kSpeckleFwhm = 0.84e-3f;     // full width at half maximum of its autocorrelation
STYLET_SHARED int kMaxLooks = 3;                 // independent complex fields
STYLET_SHARED float kSpeckleScale = 4.0f;        // standard deviations at full scale of a texel
STYLET_SHARED float kTriadThreshold = 2.5f;      // bright portal triads: texture beyond so many standard deviations
STYLET_SHARED float kTriadEdge = 0.5f;           // ... and this many more at full brightness
// Layered tissue looks its texture up at x / n along the layers and at the depth below the skin across them.
STYLET_SHARED float kLayerFwhm = 0.9e-3f;        // across the layers: fascicles and septa of 0.5-2 mm in B-mode pictures of the wall
STYLET_SHARED float kLayerX = 0.7549f;  STYLET_SHARED float kLayerY = 0.5698f;  STYLET_SHARED float kLayerZ = 0.3247f;  // unit vector of
                                                 // the lattice for the depth: along none of its periods
STYLET_SHARED float kSeptumWidth = 0.22f;        // septa lie where the texture changes its sign: half-width there, standard deviations,
STYLET_SHARED float kSeptumGap = -0.6f;          // and are broken where the beads are below this many
STYLET_SHARED float kDepthUnit = 1e-6f;          // m, of a stored depth below the skin
STYLET_SHARED int kDepthCell = 2;                // voxels a side of a cell of depths
STYLET_SHARED int kDepthSmoothing = 3;           // passes of 1-2-1 along each axis: voxels of the skin leave no steps
STYLET_SHARED int kEdges = 16;                   // of the words of voxels: distances to a surface that they tell apart ...
STYLET_SHARED float kEdgesPerVoxel = 10.0f;      // ... in tenths of a voxel: up to 1.6, and beside a surface no voxel is further than 1.74
STYLET_SHARED int kBeyond = 160;                 // voxels beyond the volume where anatomy is as at its border ...
STYLET_SHARED uint kFarOutside = 31u << 11;      // ... and the word of those further away: label 0, nothing else near

// ---- interfaces ------------------------------------------------------------------------------------------------------
STYLET_SHARED float kGradientReach = 0.8e-3f;    // m, at least; normals of voxel surfaces need several samples
STYLET_SHARED float kInterfaceGain = 60.0f;      // echo of a smooth perfect reflector over liver speckle: 35.6 dB
STYLET_SHARED float kInterfaceExponent = 12.0f;  // cos^m: m of 8-20 for soft-tissue interfaces
STYLET_SHARED float kInterfaceCoherent = 0.40f;  // share of the echo that is mirror-like ...
STYLET_SHARED float kInterfaceRough = 0.45f;     // ... and that the roughness of the interface makes random
STYLET_SHARED float kInterfaceDiffuse = 0.05f;   // scattered into all directions
STYLET_SHARED float kBeadDb = 4.5f;              // slow brightness variation along an interface, standard deviation
STYLET_SHARED float kGrazingLoss = 60.0f;        // nepers a metre lost to refraction at grazing incidence: edge shadows

// ---- gas: nothing goes on behind it; what is shown there are echoes of what lies in front ----------------------------------
STYLET_SHARED float kAirMirror = 0.22f;          // -13 dB: the mirror image of liver above the diaphragm is seen, weaker
STYLET_SHARED float kMirrorLength = 0.025f;      // m over which it loses 1/e: 0.35 dB/mm, the surface is not smooth
STYLET_SHARED float kMirrorReach = 6.0e-3f;      // m of the surface to either side that say how it is tilted
STYLET_SHARED float kMirrorStep = 2.0e-3f;       // m between two lines: more, and it is not one surface
STYLET_SHARED float kFaceReverberation = 0.01f;  // amplitude of the echo that comes again by way of the probe's face: A-lines of lung
STYLET_SHARED float kRing = 0.3f;                // froth's first reverberation over its surface, where bubbles are: -10 dB
STYLET_SHARED float kRingSpacing = 1.0e-3f;      // m between reverberations in froth, 0.5-2 mm in pictures of comet tails
STYLET_SHARED float kRingWidth = 0.25e-3f;       // m, standard deviation of each
STYLET_SHARED float kDirty = 0.04f;              // disordered echoes behind gas over the surface's, -28 dB: dirty shadow ...
STYLET_SHARED float kDirtySmooth = 0.02f;        // ... share of it behind a surface that is no froth: lung ...
STYLET_SHARED float kDirtyLength = 0.030f;       // ... and the length over which they lose 1/e, m

// ---- what heat does to tissue: engineering values, the course is that of the clinic: a bright cloud of bubbles grows round
// ---- the electrode and hides what lies behind it; when they have dissolved, a dark zone with a bright rim is left ----------
STYLET_SHARED float kBubbleEcho = 8.0f;          // amplitude of a full cloud: 18 dB over liver
STYLET_SHARED float kBubblePatches = 0.5f;       // ln of amplitude, standard deviation: clouds are uneven
STYLET_SHARED float kBubbleLoss = 46.0f;         // nepers a metre there and back in a full cloud: 4 dB/cm
STYLET_SHARED float kCoagulatedEcho = -0.46f;    // ln of amplitude in dead tissue: -4 dB
STYLET_SHARED float kCoagulatedLoss = 16.0f;     // nepers a metre on top: 0.2 dB/cm/MHz at 3.5 MHz; it attenuates more than living
STYLET_SHARED float kRimEcho = 0.70f;            // ln of amplitude at the border of the zone: +6 dB
STYLET_SHARED float kCoagulatedEdge = 1.0f;      // ln of dose over the lethal one: from this below to this above it is ...
STYLET_SHARED float kRimWidth = 3.0f;            // ... and the rim's, to either side; near the border it falls by about 2 a mm
STYLET_SHARED float kMostDose = 8.0f;            // that a texel of the zone holds, of either sign

// ---- needle: authored law, monotone in the beam-needle angle as measured by Nichols et al., AJR 180 (2003) and ------
// ---- Hopkins & Bradley, Anaesthesia and Intensive Care 29 (2001) ------------------------------------------------------
STYLET_SHARED float kNeedleGain = 24.0f;      // square to the beam over liver, 28 dB: white (kWhiteOverLiverDb) only within 20 degrees of that
STYLET_SHARED float kNeedleMirror = 1.0f;        // * sin^8 of the angle between beam and shaft: -4 dB at 20 degrees from square, -10
                                                 // at 30, -24 at 45, -48 at 60
STYLET_SHARED float kNeedleRough = 0.040f;       // * sin^2, random along the shaft: at steep angles it breaks up and drops out
STYLET_SHARED float kNeedleFloor = 0.004f;
STYLET_SHARED float kNeedleRipple = 0.40f;       // ln of amplitude along the shaft, standard deviation, 3.5 dB over kBeadFwhm: sound
                                                 // comes to it through tissue that bends it, and interferes
STYLET_SHARED float kNeedleWidth = 0.40e-3f;     // standard deviation of the echo across the shaft
STYLET_SHARED float kTipLength = 1.5e-3f;        // over which the tip shows (engineering values from here on) ...
STYLET_SHARED float kTipFloor = 0.12f;           // ... as a point seen under every angle ...
STYLET_SHARED float kBevelFlash = 0.35f;         // ... and by the bevel's edges, most with its face to the beam or away from it; a
                                                 // law of ours: * sin^2 (beam, shaft) cos^2 (roll); a tip without: its mean
STYLET_SHARED int kReverberations = 4;           // copies behind the shaft: to and fro in it, 2 diameters / c apart in time
STYLET_SHARED float kReverberationGain = 0.22f;  // first copy: -13 dB, 15 over liver, ...
STYLET_SHARED float kReverberationDecay = 0.60f; // ... and each 4.4 dB less: the tail fades
STYLET_SHARED float kLeastReverberation = 0.03f; // over liver, -30 dB: copies below are not made
STYLET_SHARED float kSideLobe = 0.02f;           // -34 dB of needle and tip, seen as an arc beside them where all else is dark ...
STYLET_SHARED float kSideLobeWidth = 3.0e-3f;    // ... standard deviation along the arc, m
STYLET_SHARED float kNeedleShadow = 0.20f;       // nepers lost behind the shaft: 18 % of the amplitude

// ---- wires: targets that the beam does not resolve ---------------------------------------------------------------------
// Standard deviation of their echo before the beam's kernels, which leave out what the speckle field is correlated over
// already (beam_profile.cpp): so the image of a wire is the point-spread function.
STYLET_SHARED float kWireWidth = 0.30028f * kSpeckleFwhm;
STYLET_SHARED float kWirePitches = 0.5f;         // and at least so many lines and samples, or it falls between them

// ---- receiver and display ---------------------------------------------------------------------------------------------
STYLET_SHARED float kTgcAttenuation = 0.50f;     // dB/cm/MHz the depth gain makes up for
STYLET_SHARED float kHazeNear = 6.0f;            // ring-down under the face: amplitude and decay length ...
STYLET_SHARED float kHazeNearDecay = 1.6e-3f;
STYLET_SHARED float kHazeFar = 0.12f;            // ... and reverberation in the abdominal wall
STYLET_SHARED float kHazeFarDecay = 14.0e-3f;
STYLET_SHARED float kHazeDepth = 0.090f;         // below, less than the receiver's noise
STYLET_SHARED float kClutter = 0.035f;           // multiple scattering and side lobes, -29 dB of what lies above ...
STYLET_SHARED float kClutterLength = 7.0e-3f;    // ... within this length, m: haze under the front wall of fluids
STYLET_SHARED float kLeastHaze = 0.2f;           // of the echo there: less is not seen
STYLET_SHARED float kContactDb = 0.8f;           // contact of head and skin, standard deviation over the face ...
STYLET_SHARED float kContactStretch = 0.35f;     // ... and how much wider than texture it changes: 7 mm
STYLET_SHARED float kWhiteOverLiverDb = 24.0f;   // liver lies at mid grey with a dynamic range of 60 dB
STYLET_SHARED float kSCurve = 0.10f;             // share of smoothstep in the grey map
STYLET_SHARED float kGreyGamma = 1.05f;
STYLET_SHARED float kPi = 3.14159265358979f;

/// A tissue as the passes read it.
struct TissueRow {
  float log_impedance;  // ln(Z)
  float loss;           // nepers of amplitude lost, there and back, a metre of depth
  float backscatter;    // amplitude
  float texture;        // slow brightness variation, ln of amplitude, standard deviation
  float layering;       // times that it is longer along the layers than across; 0: isotropic
  float septa;          // ln of amplitude over the tissue
  float triads;         // the same
  float mirror;         // amplitude of the mirror image behind it: gas; 0: none
  float ring_down;      // amplitude of a reverberation over the one before: froth; 0: none
  float unused0, unused1, unused2;  // std140 rounds up to 16 bytes
};

/// A tetrahedron cut by the image plane. At (x, z) of the plane, probe frame:
struct CutTet {
  vec4 barycentric[3];  // of nodes 1 to 3: .x + .y x + .z z; .w: the body
  vec4 rest[3];         // coordinates of the rest position: .x + .y x + .z z; .w: their slope across the plane
};

/// A piece of the needle, probe frame.
struct NeedleSegment {
  vec4 from;  // w: distance along the needle from its tip to `from`
  vec4 to;    // w: the same of `to`
};

/// A wire of the scene, probe frame.
struct WireSegment {
  vec4 from;  // w: amplitude of its echo there
  vec4 to;
};

/// Everything that is one value a frame.
struct STYLET_UNIFORM FrameConstants {
  // patient_from_probe
  vec4 origin;
  vec4 lateral;
  vec4 elevation;
  vec4 axial;
  vec4 breath;  // xyz: motion of rigid organs that go with the breath; w: body that owns their voxels, -1: none do
  vec4 bevel;        // xyz: the side that the bevel's face looks to, probe frame; w: 0, the tip has no bevel
  vec4 tgc_sliders[2];  // dB at the middle of each eighth of the depth
  // scan: convex of radius `face_radius`, or linear when it is 0
  float face_radius;
  float first_line;     // angle (convex) or x (linear) of line 0
  float line_pitch;     // rad or m
  float sample_pitch;   // m
  int lines;
  int samples;
  int noise_seed;
  int tile_columns;  // tiles of cut tetrahedra
  // label volume
  int label_nx;
  int label_ny;
  int label_nz;
  float label_x;
  float label_y;
  float label_z;
  float label_spacing;
  int depth_nx;         // depth below the skin, 0: no tissue is layered
  int depth_ny;
  int depth_nz;
  int gel_tissue;       // rows of the tissue table that are no tissue of the scene
  int filler_tissue;
  // needle
  int needle_segments;
  int wires;
  float needle_radius;
  // slice: thickness where it is thinnest and depth of that, and the distance from there to sqrt(2) of it, m
  float elevation_width;
  float elevation_focus;
  float elevation_field_depth;
  float grain;           // times that speckle is finer than kSpeckleFwhm
  // receiver and display
  float tgc;            // dB a metre
  float noise;          // amplitude before the depth gain
  float white_db;       // shown white
  float dynamic_range;  // dB from black to white
  float haze;           // 1 shows the near-field haze, 0 does not
  float gradient_reach;  // m between the centre and the taps of the interface normal
  int planes;            // across the slice thickness
  // scan-converted picture
  int width;
  int height;
  float pixel;          // m
  float picture_x;      // probe frame, of the first pixel's corner
  float picture_z;
  float tick_pitch;     // m between marks of the depth scale, 0: none
  float persistence;    // share of the frame before in what is shown; 0 in a first frame
  float coupling;       // m below the face where label 0 is gel and not air
  // heated zone: centre of its first cell, cells; none: 0
  float zone_x;
  float zone_y;
  float zone_z;
  float zone_spacing;
  int zone_nx;
  int zone_ny;
  int zone_nz;
};

#undef STYLET_SHARED
#undef STYLET_UNIFORM
#ifdef __cplusplus
}  // namespace stylet::ultrasound
#endif
