#include "engine/session/threaded_run.h"

#include "engine/session/force_scale.h"
#include "haptic/denormals.h"

#include <sys/resource.h>

#include <algorithm>
#include <limits>

namespace stylet::session {

namespace {

constexpr int kWorkerNice = 15;  // as its helper: a factor that comes later costs less than a step that does
constexpr int kMostBehind = 5;   // steps of the simulation: tissue relaxes by steps, and a lost one slows it down

}  // namespace

ThreadedRun::ThreadedRun(CoupledLoops& loops, haptic::Device& device, const content::Scene& scene,
                         const ThreadedSettings& settings)
    : loops_(loops),
      settings_(settings),
      scene_(scene),
      patches_(loops.make_patch()),
      hand_(loops, device, force_scale(scene.hand_force, device.limits())) {
  physics::copy_state(loops.needle(), needles_.back());
  needles_.publish();
  began_ns_ = clock_.now_ns();
  clock_state_.store(began_ns_, std::memory_order_release);
  worker_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
  simulation_ = std::make_unique<haptic::RealTimeThread>(
      haptic::RealTimeSettings{.rate_hz = scene.rates.simulation_hz, .fifo_priority = 0, .most_behind = kMostBehind},
      [this](const haptic::StepTiming& timing) { simulation_step(timing); });
  haptic_ = std::make_unique<haptic::RealTimeThread>(
      haptic::RealTimeSettings{.rate_hz = scene.rates.haptic_hz, .fifo_priority = settings.fifo_priority},
      [this](const haptic::StepTiming& timing) { haptic_step(timing); });
}

ThreadedRun::~ThreadedRun() {
  stop();
}

double ThreadedRun::session_s(std::int64_t clock_state, std::int64_t now_ns) const {
  return static_cast<double>(clock_state >= 0 ? now_ns - clock_state : -1 - clock_state) * 1e-9;
}

double ThreadedRun::time_s() const {
  return session_s(clock_state_.load(std::memory_order_acquire), haptic::MonotonicClock().now_ns());
}

void ThreadedRun::pause() {
  const std::int64_t begin_ns = clock_state_.load(std::memory_order_relaxed);
  if (begin_ns < 0) return;
  const std::int64_t now_ns = haptic::MonotonicClock().now_ns();
  pauses_.push_back({now_ns, std::numeric_limits<std::int64_t>::max()});
  clock_state_.store(-1 - (now_ns - begin_ns), std::memory_order_release);
}

void ThreadedRun::resume() {
  const std::int64_t stands_at = clock_state_.load(std::memory_order_relaxed);
  if (stands_at >= 0) return;
  const std::int64_t now_ns = haptic::MonotonicClock().now_ns();
  pauses_.back().length_ns = now_ns - pauses_.back().from_ns;
  clock_state_.store(now_ns + 1 + stands_at, std::memory_order_release);
}

double ThreadedRun::time_of(std::int64_t clock_ns) const {
  std::int64_t passed_ns = clock_ns - began_ns_;
  for (const Pause& pause : pauses_)
    passed_ns -= std::clamp(clock_ns - pause.from_ns, std::int64_t{0}, pause.length_ns);
  return static_cast<double>(passed_ns) * 1e-9;
}

void ThreadedRun::haptic_step(const haptic::StepTiming& timing) {
  const std::int64_t state = clock_state_.load(std::memory_order_acquire);
  // A step that began just before a pause or its end may see the other clock.
  const double time_s = std::max(session_s(state, timing.started_ns), last_step_s_);
  const double elapsed_s =
      last_step_ns_ == 0 ? loops_.haptic_dt() : static_cast<double>(timing.started_ns - last_step_ns_) * 1e-9;
  last_step_ns_ = timing.started_ns;
  if (state < 0) {
    hand_.hold(time_s, elapsed_s);
    return;
  }
  if (time_s >= settings_.duration_s) {
    finished_.store(true, std::memory_order_release);
    return;
  }
  end_s_ = time_s;
  last_step_s_ = time_s;
  patches_.update();
  const physics::NeedleState& needle = hand_.step(time_s, elapsed_s, patches_.front());
  needle_flags_ |= needle.flags;
  unresolved_.add(needle.flags);
  physics::copy_state(needle, needles_.back());
  needles_.publish();
}

void ThreadedRun::simulation_step(const haptic::StepTiming& timing) {
  const std::int64_t state = clock_state_.load(std::memory_order_acquire);
  if (finished() || state < 0) return;
  needles_.update();
  const double time_s = session_s(state, timing.started_ns);
  const physics::RigidPose probe =
      settings_.probe != nullptr ? settings_.probe->pose(time_s) : probe_pose(scene_, time_s);
  const physics::SimulationReport report =
      loops_.simulation_step(time_s, needles_.front(), probe, true, true, patches_.back());
  patch_flags_ |= patches_.back().flags;
  patches_.publish();
  if (report.factorisation_requested) requests_.release();
  simulation_flags_ |= report.flags;
  factorisations_ += report.factorisation_taken ? 1 : 0;
}

void ThreadedRun::work(const std::stop_token& stop) {
  const haptic::FlushDenormals flush;
  setpriority(PRIO_PROCESS, 0, kWorkerNice);  // of this thread alone on Linux
  while (true) {
    requests_.acquire();
    if (stop.stop_requested()) return;
    loops_.worker().step();
  }
}

void ThreadedRun::stop() {
  if (haptic_) haptic_->stop();
  if (simulation_) simulation_->stop();
  if (worker_.joinable()) {
    worker_.request_stop();
    requests_.release();
    worker_.join();
    hand_.release();
  }
}

RunStatistics ThreadedRun::statistics() const {
  const auto loop = [](const haptic::RealTimeThread& thread) {
    const haptic::LoopStatistics& measured = thread.statistics();
    return LoopRun{.steps = measured.steps.load(),
                   .rate_hz = measured.actual_rate_hz(),
                   .missed_deadlines = measured.missed.load(),
                   .step_time = measured.step_time.quantiles(),
                   .wakeup = measured.wakeup_latency.quantiles()};
  };
  LoopRun haptic = loop(*haptic_);
  LoopRun simulation = loop(*simulation_);
  haptic.steps = loops_.needle().step;  // the threads also tick between the end of the session and stop()
  simulation.steps = loops_.tissue().step;
  return {.mode = "threaded",
          .duration_s = end_s_,
          .wall_s = end_s_,
          .haptic = haptic,
          .simulation = simulation,
          .factorisations = factorisations_,
          .needle_flags = needle_flags_,
          .simulation_flags = simulation_flags_,
          .patch_flags = patch_flags_,
          .unresolved = unresolved_,
          .guard = hand_.counters(),
          .warning = haptic_->warning()};
}

}  // namespace stylet::session
