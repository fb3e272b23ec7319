#include "engine/ultrasound/imager.h"

#include "engine/gpu/pipeline.h"
#include "engine/ultrasound/diagnosis.h"
#include "engine/ultrasound/growing_buffer.h"
#include "shaders/ultrasound_attenuate.comp.h"
#include "shaders/ultrasound_axial.comp.h"
#include "shaders/ultrasound_detect.comp.h"
#include "shaders/ultrasound_gas.comp.h"
#include "shaders/ultrasound_interface.comp.h"
#include "shaders/ultrasound_label_map.comp.h"
#include "shaders/ultrasound_lateral.comp.h"
#include "shaders/ultrasound_needle.comp.h"
#include "shaders/ultrasound_scan_convert.comp.h"
#include "shaders/ultrasound_tissue.comp.h"

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <utility>

namespace stylet::ultrasound {
namespace {

using gpu::Buffer;
using gpu::ComputePipeline;
using gpu::read;
using gpu::Slot;
using gpu::write;

static_assert(sizeof(CutTet) == 96 && sizeof(NeedleSegment) == 32 && sizeof(WireSegment) == 32 &&
              sizeof(TissueRow) == 48);

constexpr std::uint32_t kGroup = 64;  ///< local_size_x of the passes over samples
constexpr std::uint32_t kLateralGroup = 16;
constexpr std::uint32_t kLineGroup = 8;  ///< of the pass over lines

/// A pass with the frame's constants at binding 0 and `buffers` storage buffers after it, but for `others`.
gpu::Interface interface(const ScanModel& model, int buffers,
                         std::initializer_list<std::pair<int, Slot>> others = {}) {
  gpu::Interface result;
  result.specialization = model.switches();
  result.slots.assign(static_cast<std::size_t>(buffers) + 1, Slot::storage_buffer);
  result.slots[0] = Slot::uniform_buffer;
  for (const auto& [binding, slot] : others) result.slots[binding] = slot;
  return result;
}

}  // namespace

struct Imager::Passes {
  Passes(gpu::Device& device_, const content::Scene& scene, const ImagerSettings& settings);
  void record(gpu::Commands& commands, const state::FrameState& state);
  bool upload_tables(gpu::Commands& commands);
  std::size_t polar_size() const { return static_cast<std::size_t>(model.scan().lines) * model.scan().samples; }

  gpu::Device& device;
  ScanModel model;
  int uploaded_tables = 0;   ///< ScanModel::tables_version()
  int uploaded_speckle = 0;  ///< ScanModel::speckle_version()
  int uploaded_zone = 0;     ///< ScanModel::zone_version()

  ComputePipeline tissue;
  ComputePipeline interfaces;
  ComputePipeline needle;
  ComputePipeline gas;
  ComputePipeline attenuate;
  ComputePipeline lateral;
  ComputePipeline axial;
  ComputePipeline detect;
  ComputePipeline scan_convert;

  // Of the scene.
  Buffer tissues;
  Buffer voxels;
  Buffer depths;
  Buffer speckle;
  GrowingBuffer zone;
  Buffer lateral_weights;
  Buffer axial_weights;
  Buffer elevation_weights;
  // Of the frame.
  Buffer frame;
  GrowingBuffer tets;
  GrowingBuffer tile_starts;
  GrowingBuffer tile_entries;
  GrowingBuffer segments;
  GrowingBuffer wires;
  GrowingBuffer thin_tiles;
  GrowingBuffer runs;
  // Polar, [sample][line] or [look][sample][line].
  Buffer echo;
  Buffer convolved;
  Buffer log_impedance;
  Buffer loss;
  Buffer found;
  Buffer fronts;  ///< of gas: first sample in it, [line]
  Buffer envelope;
  Buffer display;
  gpu::Image picture;
  gpu::Timestamps times;
  std::vector<std::uint32_t> no_fronts;  ///< where no line meets gas
  // Made when labels are asked for the first time.
  std::optional<ComputePipeline> label_map;
  std::optional<Buffer> labels;
};

Imager::Passes::Passes(gpu::Device& device_, const content::Scene& scene, const ImagerSettings& settings)
    : device(device_),
      model(scene, settings),
      tissue(device, ultrasound_tissue_comp,
             interface(model, 14,
                       {{1, Slot::texel_buffer},
                        {3, Slot::texel_buffer},
                        {4, Slot::uniform_buffer},
                        {5, Slot::texel_buffer},
                        {6, Slot::texel_buffer},
                        {7, Slot::texel_buffer},
                        {12, Slot::texel_buffer},
                        {14, Slot::texel_buffer}})),
      interfaces(device, ultrasound_interface_comp,
                 interface(model, 6, {{1, Slot::texel_buffer}, {2, Slot::texel_buffer}, {6, Slot::uniform_buffer}})),
      needle(device, ultrasound_needle_comp, interface(model, 6, {{6, Slot::texel_buffer}})),
      gas(device, ultrasound_gas_comp, interface(model, 6, {{1, Slot::texel_buffer}, {6, Slot::uniform_buffer}})),
      attenuate(device, ultrasound_attenuate_comp, interface(model, 3, {{1, Slot::texel_buffer}})),
      lateral(device, ultrasound_lateral_comp, interface(model, 3, {{2, Slot::texel_buffer}})),
      axial(device, ultrasound_axial_comp, interface(model, 3, {{2, Slot::texel_buffer}})),
      detect(device, ultrasound_detect_comp, interface(model, 3)),
      scan_convert(device, ultrasound_scan_convert_comp,
                   interface(model, 3, {{1, Slot::texel_buffer}, {2, Slot::storage_image}})),
      tissues(device, kTissueRows * sizeof(TissueRow), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT),
      voxels(storage(device, model.voxels().size() * sizeof(std::uint16_t), VK_FORMAT_R16_UINT)),
      depths(storage(device, model.layers().depth.size() * sizeof(std::uint16_t), VK_FORMAT_R16_UINT)),
      speckle(storage(device, model.speckle().texels.size() * sizeof(SpeckleField::Texel), VK_FORMAT_R8G8_SNORM)),
      zone(device, VK_FORMAT_R8G8_UNORM),
      lateral_weights(storage(device, model.beam().lateral.size() * sizeof(float))),
      axial_weights(storage(device, model.beam().axial.size() * sizeof(float))),
      elevation_weights(storage(device, model.beam().elevation.size() * sizeof(float), VK_FORMAT_R32_SFLOAT)),
      frame(device, sizeof(FrameConstants), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT),
      tets(device, VK_FORMAT_R32G32B32A32_SFLOAT),
      tile_starts(device),
      tile_entries(device, VK_FORMAT_R32_UINT),
      segments(device),
      wires(device),
      thin_tiles(device),
      runs(device),
      echo(storage(device, polar_size() * settings.looks * 2 * sizeof(float), VK_FORMAT_R32G32_SFLOAT)),
      convolved(storage(device, polar_size() * settings.looks * 2 * sizeof(float), VK_FORMAT_R32G32_SFLOAT)),
      log_impedance(storage(device, polar_size() * sizeof(float), VK_FORMAT_R32_SFLOAT)),
      loss(storage(device, polar_size() * sizeof(float))),
      found(storage(device, polar_size() * sizeof(std::uint32_t))),
      fronts(storage(device, model.scan().lines * sizeof(std::uint32_t))),
      envelope(storage(device, polar_size() * sizeof(float))),
      display(storage(device, polar_size() * sizeof(float), VK_FORMAT_R32_SFLOAT)),
      picture(device, {.width = static_cast<std::uint32_t>(settings.width),
                       .height = static_cast<std::uint32_t>(settings.height),
                       .format = VK_FORMAT_R8G8B8A8_UNORM,
                       .usage = gpu::kStorageUsage}),
      times(device, 16),
      no_fronts(static_cast<std::size_t>(model.scan().lines), std::numeric_limits<std::uint32_t>::max()) {
  gpu::run_now(device, [this](gpu::Commands& commands) {
    commands.upload(voxels, std::as_bytes(std::span(model.voxels())));
    if (!model.layers().depth.empty()) commands.upload(depths, std::as_bytes(std::span(model.layers().depth)));
  });
}

/// The tables that the controls and the tissue table change. @return  whether they have
bool Imager::Passes::upload_tables(gpu::Commands& commands) {
  if (uploaded_tables == model.tables_version()) return false;
  uploaded_tables = model.tables_version();
  const auto upload = [&commands](const Buffer& to, const auto& items) {
    commands.upload(to, std::as_bytes(std::span(items)));
  };
  upload(tissues, model.tissues());
  upload(lateral_weights, model.beam().lateral);
  upload(axial_weights, model.beam().axial);
  upload(elevation_weights, model.beam().elevation);
  runs.upload(commands, std::span<const std::uint32_t>(model.picture_runs()));
  return true;
}

void Imager::Passes::record(gpu::Commands& commands, const state::FrameState& state) {
  model.update(state);
  const FrameConstants& c = model.constants();
  const auto groups = [](int count, std::uint32_t size) {
    return (static_cast<std::uint32_t>(count) + size - 1) / size;
  };
  const std::uint32_t rows = static_cast<std::uint32_t>(c.samples);
  const std::uint32_t looks = model.switches()[0];
  const std::array<std::uint32_t, 3> samples{groups(c.lines, kGroup), rows, 1};

  times.reset(commands);
  times.mark(commands, "start");
  const bool anew = upload_tables(commands);
  if (uploaded_speckle != model.speckle_version()) {
    uploaded_speckle = model.speckle_version();
    commands.upload(speckle, std::as_bytes(std::span(model.speckle().texels)));
  }
  if (uploaded_zone != model.zone_version()) {
    uploaded_zone = model.zone_version();
    zone.upload(commands, std::span(model.zone_texels()));
  }
  commands.upload(frame, std::as_bytes(std::span(&c, 1)));
  commands.upload(fronts, std::as_bytes(std::span(no_fronts)));
  tets.upload(commands, model.slice().tets());
  tile_starts.upload(commands, model.slice().starts());
  tile_entries.upload(commands, model.slice().entries());
  segments.upload(commands, std::span<const NeedleSegment>(model.needle()));
  wires.upload(commands, std::span<const WireSegment>(model.wires()));
  thin_tiles.upload(commands, std::span<const std::uint32_t>(model.thin_tiles()));
  times.mark(commands, "upload");

  commands.dispatch(tissue,
                    {read(0, frame), read(1, tets.buffer()), read(2, tile_starts.buffer()),
                     read(3, tile_entries.buffer()), read(4, tissues), read(5, voxels), read(6, speckle),
                     read(7, elevation_weights), write(8, echo), write(9, log_impedance), write(10, loss),
                     write(11, found), read(12, depths), write(13, fronts), read(14, zone.buffer())},
                    {static_cast<std::uint32_t>(model.slice().columns()), rows, 1});
  times.mark(commands, "tissue");
  commands.dispatch(interfaces,
                    {read(0, frame), read(1, speckle), read(2, log_impedance), read(3, found), write(4, echo),
                     write(5, loss), read(6, tissues)},
                    samples);
  times.mark(commands, "interfaces");
  if (!model.thin_tiles().empty()) {
    commands.dispatch(needle,
                      {read(0, frame), read(1, segments.buffer()), read(2, wires.buffer()), write(3, echo),
                       write(4, loss), read(5, thin_tiles.buffer()), read(6, speckle)},
                      {static_cast<std::uint32_t>(model.thin_tiles().size()), 1, 1});
  }
  times.mark(commands, "needle");
  commands.dispatch(gas,
                    {read(0, frame), read(1, speckle), read(2, fronts), read(3, found), write(4, echo),
                     write(5, loss), read(6, tissues)},
                    {groups(c.lines, kLineGroup), 1, 1});
  times.mark(commands, "gas");
  commands.dispatch(attenuate, {read(0, frame), read(1, speckle), read(2, loss), write(3, echo)},
                    {groups(c.lines, kLineGroup), 1, 1});
  times.mark(commands, "attenuate");
  commands.dispatch(lateral, {read(0, frame), read(1, lateral_weights), read(2, echo), write(3, convolved)},
                    {groups(c.lines, kLateralGroup * kBlock), rows, looks});
  times.mark(commands, "lateral");
  commands.dispatch(axial, {read(0, frame), read(1, axial_weights), read(2, convolved), write(3, echo)},
                    {groups(c.lines, kGroup), groups(c.samples, kBlock), looks});
  times.mark(commands, "axial");
  commands.dispatch(detect, {read(0, frame), read(1, echo), write(2, envelope), write(3, display)}, samples);
  times.mark(commands, "detect");
  // Around the sector nothing changes from frame to frame.
  const std::size_t shown = anew ? model.picture_runs().size() : static_cast<std::size_t>(model.sector_runs());
  commands.dispatch(scan_convert, {read(0, frame), read(1, display), write(2, picture), read(3, runs.buffer())},
                    {static_cast<std::uint32_t>(shown), 1, 1});
  times.mark(commands, "scan conversion");
}

Imager::Imager(gpu::Device& device, const content::Scene& scene, const ImagerSettings& settings)
    : passes_(std::make_unique<Passes>(device, scene, settings)) {}

Imager::~Imager() = default;

void Imager::record(gpu::Commands& commands, const state::FrameState& state) {
  passes_->record(commands, state);
}

const gpu::Image& Imager::image(const state::FrameState& state) {
  gpu::run_now(passes_->device, [&](gpu::Commands& commands) { record(commands, state); });
  return passes_->picture;
}

void Imager::restart() {
  passes_->model.restart();
}

const ScannerControls& Imager::controls() const {
  return passes_->model.controls();
}

std::string Imager::set_controls(const ScannerControls& controls) {
  return passes_->model.set_controls(controls);
}

void Imager::set_seed(std::uint32_t seed) {
  passes_->model.set_seed(seed);
}

void Imager::set_acoustics(std::span<const content::Tissue> tissues) {
  passes_->model.set_acoustics(tissues);
}

std::string Imager::diagnosis() const {
  return diagnose(passes_->model);
}

const gpu::Image& Imager::image() const {
  return passes_->picture;
}

std::vector<std::uint8_t> Imager::read_back() {
  const std::vector<std::byte> rgba = gpu::read_back(passes_->device, passes_->picture);
  std::vector<std::uint8_t> grey(rgba.size() / 4);
  for (std::size_t i = 0; i < grey.size(); ++i) grey[i] = std::to_integer<std::uint8_t>(rgba[4 * i]);
  return grey;
}

std::vector<std::uint8_t> Imager::read_label_map() {
  Passes& p = *passes_;
  const FrameConstants& c = p.model.constants();
  if (!p.label_map) {
    p.label_map.emplace(p.device, ultrasound_label_map_comp, interface(p.model, 3));
    p.labels.emplace(storage(p.device, static_cast<std::size_t>(c.width) * c.height * sizeof(std::uint32_t)));
  }
  gpu::run_now(p.device, [&](gpu::Commands& commands) {
    commands.dispatch(
        *p.label_map, {read(0, p.frame), read(1, p.found), read(2, p.segments.buffer()), write(3, *p.labels)},
        {(static_cast<std::uint32_t>(c.width) + kGroup - 1) / kGroup, static_cast<std::uint32_t>(c.height), 1});
  });
  const std::vector<std::uint32_t> words = gpu::read_back<std::uint32_t>(p.device, *p.labels);
  return {words.begin(), words.begin() + static_cast<std::ptrdiff_t>(c.width) * c.height};
}

std::vector<float> Imager::read_back_envelope() {
  return gpu::read_back<float>(passes_->device, passes_->envelope);
}

std::vector<gpu::Timestamps::Span> Imager::pass_times() const {
  return passes_->times.read();
}

const SectorGeometry& Imager::geometry() const {
  return passes_->model.sector();
}
const ScanGeometry& Imager::scan() const {
  return passes_->model.scan();
}

}  // namespace stylet::ultrasound
