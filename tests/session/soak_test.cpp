// The default scenario for many minutes of session time: nothing fails, grows or drifts.
//
// A pass plays the recorded motion to its end and then backwards, so that the needle is outside again and the tissue
// comes to rest. STYLET_SOAK_MINUTES: session time, 30 if unset. Run by tools/test.sh --all.
#include "tests/session/soak.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/lockstep.h"
#include "engine/session/recorded_stylus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <utility>
#include <vector>

namespace stylet::session {
namespace {

/// What a pass showed.
struct Pass {
  double peak_force = 0;         ///< on the hand, N
  double peak_displacement = 0;  ///< of a tissue node, m
  int most_contacts = 0;
  int contacts_at_end = 0;
  /// Of a tissue node at the end of the pass: of the first two since the end of the one before, of the others since
  /// the end of the second, m.
  double drift = 0;
  double resident_mib = 0;
};

class PassObserver final : public StepListener {
public:
  PassObserver(const content::Scene& scene, double pass_s) : scene_(scene), pass_s_(pass_s) {}

  void haptic_stepped(const recording::HapticStepRecord&, const physics::NeedleState& needle) override {
    finite_ = finite_ && needle.wrench.force.allFinite() && needle.wrench.moment.allFinite();
    pass_.peak_force = std::max(pass_.peak_force, needle.wrench.force.norm());
    pass_.most_contacts = std::max(pass_.most_contacts, needle.contact_count);
  }
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport&,
                          const physics::TissueState& tissue, const physics::NeedleState& needle) override {
    untouched_ = untouched_ && needle.contact_count == 0 && needle.tip == physics::TipState::outside;
    if (untouched_) keep(tissue);
    if (record.time_s >= static_cast<double>(passes_.size() + 1) * pass_s_ - 1.5 / scene_.rates.simulation_hz) {
      pass_.drift = displacement(tissue, before_);
      pass_.contacts_at_end = needle.contact_count;
      pass_.resident_mib = tests::resident_mib();
      std::printf(
          "pass %3zu  peak force %.6f N  deepest %.6f mm  contacts %2d  drift at rest %.3e m  resident %.1f MiB\n",
          passes_.size() + 1, pass_.peak_force, 1e3 * pass_.peak_displacement, pass_.most_contacts, pass_.drift,
          pass_.resident_mib);
      std::fflush(stdout);
      if (passes_.size() < 2) keep(tissue);
      passes_.push_back(std::exchange(pass_, {}));
    }
    pass_.peak_displacement = std::max(pass_.peak_displacement, displacement(tissue, before_));
  }

  const std::vector<Pass>& passes() const { return passes_; }
  bool finite() const { return finite_; }

private:
  static double displacement(const physics::TissueState& tissue, const std::vector<Eigen::Matrix3Xd>& from) {
    double most = 0;
    for (std::size_t b = 0; b < from.size(); ++b) {
      most = std::max(most, (tissue.positions[b] - from[b]).colwise().norm().maxCoeff());
    }
    return most;
  }

  void keep(const physics::TissueState& tissue) {
    before_.assign(tissue.positions.begin(), tissue.positions.begin() + tissue.body_count);
  }

  const content::Scene& scene_;
  double pass_s_;
  Pass pass_;
  std::vector<Pass> passes_;
  // At first before the needle, not the meshes: the probe presses and the organs touch. The first two passes differ,
  // since the second cuts nothing, and the probe's friction holds the skin where the needle has dragged it.
  std::vector<Eigen::Matrix3Xd> before_;
  bool untouched_ = true;
  bool finite_ = true;
};

TEST(Soak, DefaultScenarioNeitherFailsNorGrowsNorDrifts) {
  const content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  tests::RepeatedMotion device(recorded_stylus(scene.motion), 1 / scene.rates.simulation_hz);
  const haptic::StylusSample start = device.read(0);
  PassObserver observer(scene, device.pass_s());
  CoupledLoops loops(scene, coupling_from_name(scene.coupling), {start.position, start.orientation}, {&observer});
  const int count =
      std::max(3, static_cast<int>(std::ceil(60 * tests::minutes("STYLET_SOAK_MINUTES", 30) / device.pass_s())));
  const RunStatistics run = run_lockstep(loops, device, scene, count * device.pass_s());
  std::printf("%.1f minutes of session time in %.1f s, %llu haptic and %llu simulation steps, %llu factorisations\n",
              run.duration_s / 60, run.wall_s, static_cast<unsigned long long>(run.haptic.steps),
              static_cast<unsigned long long>(run.simulation.steps),
              static_cast<unsigned long long>(run.factorisations));

  const std::uint32_t failed = physics::kNeedleRowOverflow | physics::kNeedleSolveFailed | physics::kNeedleNonFinite;
  EXPECT_EQ(run.needle_flags & failed, 0u);
  EXPECT_EQ(run.simulation_flags & (physics::kSimulationNonFinite | physics::kSimulationFactorisationFailed), 0u);
  EXPECT_EQ(run.patch_flags, 0u) << "a capacity overflowed";
  EXPECT_EQ(run.guard.count(haptic::kOutputNonFinite), 0u);
  EXPECT_TRUE(observer.finite());

  const std::vector<Pass>& passes = observer.passes();
  ASSERT_EQ(passes.size(), static_cast<std::size_t>(count));
  const Pass& first = passes.front();
  ASSERT_GT(first.most_contacts, 3) << "the needle went in";
  ASSERT_GT(first.peak_force, 1);
  ASSERT_GT(first.peak_displacement, 1e-3);
  EXPECT_LT(first.drift, 2e-4);  // the pressed probe's friction holds the skin there
  EXPECT_LT(passes[1].drift, 1e-5);
  // From the second pass on the needle finds its track again, so all of them are alike; the schedule of the
  // factorisations differs, so not to the bit.
  const Pass& second = passes[1];
  EXPECT_LT(second.peak_force, first.peak_force) << "nothing is cut again";
  for (std::size_t i = 1; i < passes.size(); ++i) {
    const Pass& pass = passes[i];
    EXPECT_NEAR(pass.peak_force, second.peak_force, 0.05 * second.peak_force);
    EXPECT_EQ(pass.contacts_at_end, 0);
    if (i > 1) {
      EXPECT_LT(pass.drift, 1e-6);  // a millionth of a metre after a second at rest, and no pass adds to it
    }
  }
  // Everything is sized at load: from the second pass on only the allocator's and the kernel's own bookkeeping moves.
  std::vector<double> resident;
  for (std::size_t i = 1; i < passes.size(); ++i) resident.push_back(passes[i].resident_mib);
  std::printf("grown by %.1f MiB\n", tests::growth(resident));
  EXPECT_LT(tests::growth(resident), 1);
}

}  // namespace
}  // namespace stylet::session
