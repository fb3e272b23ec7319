#include "engine/procedures/aspiration/aspiration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

namespace stylet::procedures::aspiration {
namespace {

/// Venous blood: four times as thick as water, under the pressure of a hepatic vein.
constexpr Fluid kBlood{.viscosity = 3.5e-3, .density = 1060};
constexpr double kVenousPressure = 700;  // Pa, 5 mmHg

}  // namespace

struct Aspiration::Seen final : Observation {
  Outcome outcome;
  double flow = 0;
  double syringe = 0;        // what it holds, m^3
  std::vector<double> left;  // [cavities] m^3
};

Aspiration::Aspiration(const content::Scene& scene)
    : scene_(scene),
      plan_(plan_of(scene.exercise)),
      bore_{.diameter = scene.needle.inner_diameter, .length = scene.needle.length},
      blood_(scene.tissues.size(), false),
      shares_(scene.cavities.size(), 1),
      syringe_shown_{.capacity = static_cast<float>(plan_.syringe.capacity)} {
  for (const content::Surface& surface : scene.surfaces) {
    if (surface.role == content::SurfaceRole::vessel) blood_[surface.tissue] = true;
  }
  for (const content::Cavity& cavity : scene.cavities) {
    const physics::TetMesh& mesh = scene.bodies[cavity.body].mesh;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int tet : cavity.tets) {
      for (const int node : mesh.tets[tet]) sum += mesh.nodes[node];
    }
    centers_.emplace_back(sum / (4.0 * static_cast<double>(cavity.tets.size())));
    left_.push_back(cavity.volume);
    volume_ += cavity.volume;
  }
}

std::unique_ptr<Observation> Aspiration::make_observation() const {
  auto seen = std::make_unique<Seen>();
  seen->left = left_;
  return seen;
}

int Aspiration::cavity_at(const content::TissuePlace& place) const {
  if (!scene_.tissues[place.tissue].fluid) return -1;
  int nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < scene_.cavities.size(); ++c) {
    const double distance = (place.rest - centers_[c]).norm();
    if (scene_.cavities[c].body != place.body || distance >= least) continue;
    least = distance;
    nearest = static_cast<int>(c);
  }
  return nearest;
}

void Aspiration::observe(const Step& step, Observation* seen) {
  const double dt = last_s_ >= 0 ? step.time_s - last_s_ : 0;
  last_s_ = step.time_s;
  const int cavity = step.in_tissue ? cavity_at(step.at_tip) : -1;
  const bool vessel = step.in_tissue && blood_[step.at_tip.tissue];
  if (cavity >= 0 && !inside_) ++so_far_.entries;
  inside_ = cavity >= 0;

  DrawInput input{.pulls = pulls_.load(std::memory_order_acquire)};
  if (cavity >= 0) {
    input.opening = Opening::fluid;
    input.available = std::max(0.0, left_[cavity] - kResidue * scene_.cavities[cavity].volume);
    input.pressure = static_cast<std::size_t>(cavity) < step.cavities.size() ? step.cavities[cavity].pressure : 0;
  } else if (vessel) {
    input.opening = Opening::fluid;
    input.available = plan_.syringe.capacity;
    input.pressure = kVenousPressure;
  } else if (!step.in_tissue) {
    input.opening = Opening::air;
  }
  const double before = syringe_.drawn;
  if (dt > 0 && (input.pulls || syringe_.plunger > 0)) {
    draw(plan_.syringe, bore_, vessel ? kBlood : plan_.fluid, input, dt, syringe_);
  }
  const double came = syringe_.drawn - before;
  if (cavity >= 0) {
    left_[cavity] -= came;
    so_far_.drawn += came;
  } else {
    so_far_.wrong += came;
  }
  so_far_.air = syringe_.air;
  double left = 0;
  for (const double volume : left_) left += volume;
  so_far_.left_share = volume_ > 0 ? left / volume_ : 0;

  auto& out = static_cast<Seen&>(*seen);
  out.outcome = so_far_;
  out.flow = dt > 0 ? came / dt : 0;
  out.syringe = syringe_.drawn;
  std::ranges::copy(left_, out.left.begin());
}

void Aspiration::fill_cavities(std::span<double> shares) {
  for (std::size_t c = 0; c < shares.size(); ++c) shares[c] = left_[c] / scene_.cavities[c].volume;
}

std::span<const Action> Aspiration::actions() const {
  static constexpr std::array kActions{kDraw, kStop};
  return kActions;
}

const Aspiration::Seen* Aspiration::seen(const Situation& now) const {
  return static_cast<const Seen*>(now.observation);
}

std::string Aspiration::reason_against(Action action, const Situation& now) const {
  if (action == kStop) return drawing_ ? "" : "nothing is being drawn";
  if (drawing_) return "the syringe is being drawn already";
  const Seen* last = seen(now);
  if (last != nullptr && last->syringe >= plan_.syringe.capacity) return "the syringe is full; finish";
  if (now.in_tissue) return "";
  return fmt::format("the tip is {}: you would draw air; advance the needle", place_of_free_tip(now));
}

void Aspiration::act(Action action, const Situation& now, Events& events) {
  if (action == kStop) return stop(now, events);
  drawing_ = true;
  dry_s_ = 0;
  pulls_.store(true, std::memory_order_release);
  events.push_back(event_at(now, kStartedEvent));
}

void Aspiration::pass(double elapsed_s) {
  dry_s_ = drawing_ && flow_ <= 0 ? dry_s_ + elapsed_s : 0;
}

void Aspiration::go_on(const Situation& now, Events& events) {
  const Seen* last = seen(now);
  if (!drawing_ || last == nullptr) return;
  const bool nobody_stops = plan_.automatic && dry_s_ >= kDry;
  if (nobody_stops || last->syringe >= plan_.syringe.capacity) stop(now, events);
}

void Aspiration::finish(const Situation& now, Events& events) {
  if (drawing_) stop(now, events);
}

void Aspiration::stop(const Situation& now, Events& events) {
  drawing_ = false;
  ++stops_;
  pulls_.store(false, std::memory_order_release);
  if (const Seen* last = seen(now)) outcome_ = last->outcome;
  events.push_back(event_at(now, kStoppedEvent, {{"drawn", outcome_.drawn, "m^3"}}));
  events.push_back(to_event(outcome_, now));
}

void Aspiration::catch_up(const Situation& now, Events&) {
  const Seen* last = seen(now);
  if (last == nullptr) return;
  outcome_ = last->outcome;
  flow_ = last->flow;
  for (std::size_t c = 0; c < shares_.size(); ++c)
    shares_[c] = static_cast<float>(last->left[c] / scene_.cavities[c].volume);
  syringe_shown_.held = static_cast<float>(last->syringe);
}

std::string Aspiration::prompt(const PromptInput& input) const {
  if (input.stage == Stage::procedure) {
    if (!input.in_target) return "Advance the needle into the cyst.";
    return fmt::format("The tip is in the cyst: {}.", with_control("draw", input.controls.act));
  }
  const std::string so_far = fmt::format("{:.0f} of {:.0f} ml", outcome_.drawn * 1e6, volume_ * 1e6);
  if (!drawing_)
    return fmt::format("{} are drawn: withdraw the needle and {}.", so_far,
                       with_control("finish", input.controls.finish));
  if (flow_ > 0) return fmt::format("Drawing: {}. Keep the tip in the fluid.", so_far);
  return fmt::format("Nothing comes, with {} drawn: the opening is not in fluid, or the cyst is empty.", so_far);
}

std::string Aspiration::result_in_words() const {
  return stops_ > 0 ? fmt::format("aspiration: {}\n", in_words(outcome_)) : "";
}

void Aspiration::show(state::FrameState& frame) const {
  frame.cavity_shares = shares_;
  frame.syringe = syringe_shown_;
}

}  // namespace stylet::procedures::aspiration
