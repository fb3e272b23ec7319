#include "tools/bench/competence.h"

#include "engine/lab/delivery/outbox.h"
#include "engine/lab/statistics/cell_chain.h"
#include "engine/lab/statistics/curve_fit.h"
#include "engine/lab/statistics/proportion.h"
#include "engine/lab/statistics/run_length.h"
#include "engine/lab/statistics/sequential.h"
#include "engine/lab/store/lab.h"
#include "tools/bench/competence_stations.h"
#include "tools/bench/samples.h"
#include "tools/bench/scratch.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {

namespace {

using namespace lab::statistics;

constexpr FailureRates kUsual{.acceptable = 0.10, .unacceptable = 0.30};

/// The same numbers on every machine.
class Random {
public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  Outcome outcome(double failure_rate) {
    return static_cast<double>(engine_() >> 11) * 0x1p-53 < failure_rate ? Outcome::fail : Outcome::pass;
  }

private:
  std::mt19937_64 engine_;
};

std::string rates_name(const FailureRates& rates) {
  return fmt::format("{:.2f}_{:.2f}", rates.acceptable, rates.unacceptable);
}

/// Mean attempts to the signal of simulated trainees, each to the end: as run_chart adds them up.
double simulated_run_length(const Weights& weights, double failure_rate, double limit, int trainees, Random& random) {
  double attempts = 0;
  for (int i = 0; i < trainees; ++i) {
    double sum = 0;
    do {
      sum = std::max(0.0, sum + weights.of(random.outcome(failure_rate)));
      ++attempts;
    } while (sum < limit - kSumTolerance);
  }
  return attempts / trainees;
}

void measure_run_lengths(Report& report, int trainees) {
  const struct {
    FailureRates rates;
    double limit;
  } charts[]{{{.05, .15}, 2.0}, {{.05, .15}, 3.0}, {{.10, .20}, 1.25}, {{.10, .20}, 2.0},
             {{.10, .20}, 3.0}, {{.10, .30}, 1.5}, {{.10, .30}, 2.0},  {{.10, .30}, 2.5},
             {{.10, .30}, 3.0}, {{.15, .30}, 2.0}, {{.20, .40}, 2.0},  {{.20, .40}, 3.0}};
  Random random(27);
  const auto measure = [&](const std::string& name, const Weights& weights, double failure_rate, double limit) {
    const double exact = mean_run_length({weights, failure_rate}, limit);
    // Run lengths scatter by about their mean: this many make the simulation good to half a percent.
    const double simulated = simulated_run_length(weights, failure_rate, limit, trainees, random);
    report.add(within(name, simulated, "attempts", exact, 0.02 * exact));
  };
  for (const auto& chart : charts) {
    const Weights weights = learning_weights(chart.rates);
    const std::string name = fmt::format("run_length.lc_cusum.{}.h{:.2f}", rates_name(chart.rates), chart.limit);
    measure(name + ".acceptable", weights, chart.rates.acceptable, chart.limit);
    measure(name + ".unacceptable", weights, chart.rates.unacceptable, chart.limit);
  }
  for (const double limit : {1.5, 2.5, 3.0}) {
    const std::string name = fmt::format("run_length.cusum.{}.h{:.2f}", rates_name(kUsual), limit);
    measure(name + ".acceptable", monitoring_weights(kUsual), kUsual.acceptable, limit);
    measure(name + ".unacceptable", monitoring_weights(kUsual), kUsual.unacceptable, limit);
  }
}

void measure_published(Report& report) {
  const auto add = [&](std::string name, double value, double published, double tolerance, std::string source) {
    report.add(noted(within(std::move(name), value, "attempts", published, tolerance), std::move(source)));
  };
  add("published.normal_cusum.k0.5_h3", normal_cusum_run_length(0.5, 3, 0), 117.59, 0.02, "Brook and Evans 1972");
  const auto two_sided = [](double shift) {
    return 1 / (1 / normal_cusum_run_length(0.5, 4, shift) + 1 / normal_cusum_run_length(0.5, 4, -shift));
  };
  add("published.two_sided_cusum.k0.5_h4", two_sided(0), 168, 0.5, "Lucas and Crosier 1982");
  add("published.two_sided_cusum.k0.5_h4.shift1", two_sided(1), 8.38, 0.01, "Lucas and Crosier 1982");
  const struct {
    double weight;
    double width;
    std::array<double, 4> lengths;  // at shifts 0, 0.5, 1, 2
  } ewmas[]{{0.5, 3.071, {500, 88.8, 17.5, 3.63}}, {0.03, 2.437, {500, 29.3, 12.6, 5.99}}};
  constexpr std::array kShifts{0.0, 0.5, 1.0, 2.0};
  for (const auto& ewma : ewmas) {
    for (std::size_t i = 0; i < kShifts.size(); ++i) {
      add(fmt::format("published.ewma.w{}.shift{}", ewma.weight, kShifts[i]),
          normal_ewma_run_length(ewma.weight, ewma.width, kShifts[i]), ewma.lengths[i], 2e-3 * ewma.lengths[i],
          "Lucas and Saccucci 1990");
    }
  }
  const auto share = [&](std::string name, double value, double published, std::string source) {
    report.add(noted(within(std::move(name), value, "1", published, 0.003), std::move(source)));
  };
  share("published.bernoulli_cusum.worse", signal_within({monitoring_weights_by_risk(0.05, 2), 0.05}, 100, 2.96),
        0.038, "10,000 runs, CRAN cusum");
  share("published.bernoulli_cusum.better", signal_within({monitoring_weights_by_risk(0.10, 0.5), 0.10}, 100, 2.96),
        0.026, "10,000 runs, CRAN cusum");
}

/// NIST StRD, nonlinear: BoxBOD.
void measure_certified(Report& report) {
  constexpr std::array kX{1.0, 2.0, 3.0, 5.0, 7.0, 10.0};
  constexpr std::array kY{109.0, 149.0, 149.0, 191.0, 213.0, 224.0};
  const CurveModel rise = [](double x, const Eigen::VectorXd& p, Eigen::VectorXd& gradient) {
    const double e = std::exp(-p[1] * x);
    gradient[0] = 1 - e;
    gradient[1] = p[0] * x * e;
    return p[0] * gradient[0];
  };
  constexpr std::array<CurveParameter, 2> kStart{{{100}, {0.75}}};
  const CurveFit fit = fit_curve(rise, kX, kY, kStart);
  const auto add = [&](const char* name, double value, double certified) {
    report.add(noted(within(name, value, "1", certified, 1e-9 * certified), "NIST StRD"));
  };
  add("certified.boxbod.b1", fit.parameters[0], 213.80940889);
  add("certified.boxbod.b2", fit.parameters[1], 0.54723748542);
  add("certified.boxbod.b1.standard_error", fit.standard_error(0), 12.354515176);
  add("certified.boxbod.b2.standard_error", fit.standard_error(1), 0.10455993237);
}

/// Failure rate of the attempt t, from 1.
using Skill = double (*)(int t);

void measure_cohort(Report& report, const std::string& name, Skill skill, const Gate& gate, bool competent,
                    int trainees, Random& random) {
  constexpr int kInARow = 5;
  const Weights weights = learning_weights(kUsual);
  std::vector<int> signals;
  int in_a_row = 0;
  std::vector<AttemptLaw> laws;
  for (int t = 1; t <= gate.horizon; ++t) laws.push_back({weights, skill(t)});
  for (int i = 0; i < trainees; ++i) {
    std::vector<Outcome> outcomes;
    int run = 0;
    bool reached = false;
    for (int t = 1; t <= gate.horizon; ++t) {
      outcomes.push_back(random.outcome(skill(t)));
      run = outcomes.back() == Outcome::pass ? run + 1 : 0;
      reached = reached || run == kInARow;
    }
    const auto chart = run_chart(weights, outcomes, gate.limit, AfterSignal::go_on);
    if (const auto signal = first_signal(chart)) signals.push_back(*signal);
    in_a_row += reached ? 1 : 0;
  }
  const double share = static_cast<double>(signals.size()) / trainees;
  const double exact = signal_by(laws, gate.limit).back();
  // Three standard errors of a share of so many trainees.
  const double error = 3 * std::sqrt(std::max(exact * (1 - exact), 1e-6) / trainees);
  const std::string declared = fmt::format("cohort.{}.declared_competent", name);
  report.add(
      noted(within(declared + ".lc_cusum", share, "1", exact, error), "of simulated trainees; exact beside it"));
  if (!competent) report.add(at_most(declared + ".lc_cusum.false", share, "1", 0.05));
  report.add({declared + ".five_in_a_row", static_cast<double>(in_a_row) / trainees, "1"});
  report.add(noted({declared + ".fixed_number", 1, "1"}, fmt::format("everybody, after {} attempts", gate.horizon)));
  if (signals.empty()) return;
  std::ranges::sort(signals);
  report.add({fmt::format("cohort.{}.attempts.median", name),
              static_cast<double>(signals[signals.size() / 2]),
              "attempts",
              {},
              {},
              {},
              "of those declared"});
}

void measure_cohorts(Report& report, int trainees) {
  const Gate gate = learning_gate(kUsual, 30, 0.05);
  report.add(within("gate.limit", gate.limit, "1", 3.52, 0.005));
  report.add(at_most("gate.false_discovery", gate.false_discovery, "1", 0.05, 0.041));
  report.add(within("gate.true_discovery", gate.true_discovery, "1", 0.716, 0.0006));
  Random random(2026);
  measure_cohort(
      report, "acceptable", [](int) { return 0.10; }, gate, true, trainees, random);
  measure_cohort(
      report, "unacceptable", [](int) { return 0.30; }, gate, false, trainees, random);
  measure_cohort(
      report, "every_second", [](int) { return 0.50; }, gate, false, trainees, random);
  measure_cohort(
      report, "learner", [](int t) { return 0.05 + 0.55 * std::exp(-(t - 1) / 8.0); }, gate, true, trainees, random);
  report.add(within("in_a_row.two_of_ten.half", in_a_row_within(2, 10, 0.5), "1", 0.859, 5e-4));
  report.add(within("in_a_row.five_of_thirty.half", in_a_row_within(5, 30, 0.5), "1", 0.368, 5e-4));
}

template <typename Act>
double milliseconds(const Act& act) {
  const auto begun = std::chrono::steady_clock::now();
  act();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count();
}

/// 100 trainees with 31 metrics an attempt: what keeping one costs, and what each page asks for.
void measure_records(Report& report, int attempts) {
  constexpr int kTrainees = 100;
  constexpr int kMetrics = 31;
  constexpr int kTimed = 200;  // attempts, the last ones, each with its commits
  const Scratch folder;
  lab::store::Lab records({.folder = folder.path(), .build = "bench"});
  std::vector<lab::store::Person> people;
  for (int i = 0; i < kTrainees; ++i) people.push_back(records.enrolled(fmt::format("trainee {}", i)));
  lab::store::AttemptEnd end{.total = 80, .pass_mark = 70, .passed = true, .state_hash = "00ff00ff00ff00ff"};
  for (int i = 0; i < kMetrics; ++i)
    end.metrics.push_back({.metric = fmt::format("metric_number_{:02}", i), .value = i / 7.0, .points = 3.2});
  Samples begun;
  Samples ended;
  // Most without a sync of each: the same rows, and no minutes of waiting for a disk.
  records.database().run("PRAGMA synchronous=OFF");
  for (int i = 0; i < attempts; ++i) {
    const bool timed = i >= attempts - kTimed;
    if (i == attempts - kTimed) records.database().run("PRAGMA synchronous=FULL");
    const lab::store::AttemptStart start{
        .trainee = people[static_cast<std::size_t>(i % kTrainees)].id,
        .scenario = {.sha256 = std::string(64, 'a'), .name = "liver_biopsy", .title = "Liver biopsy", .text = "[]"},
        .build = "0.1.0 (commit 0123456)",
        .stylus = "recorded stylus",
        .loop_mode = "threaded"};
    std::string attempt;
    const double begin_ms = milliseconds([&] { attempt = records.begin(start); });
    const double end_ms = milliseconds([&] { records.end(attempt, end); });
    if (!timed) continue;
    begun.add(begin_ms);
    ended.add(end_ms);
  }
  report.add({"records.begin.median", begun.median(), "ms"});
  report.add(noted(at_most("records.end.median", ended.median(), "ms", 100), "with its metrics, synced to the disk"));
  report.add({"records.end.max", ended.max(), "ms"});
  Samples trainee;
  Samples cohort;
  for (int i = 0; i < 20; ++i) {
    const std::string& who = people[static_cast<std::size_t>(i)].id;
    trainee.add(milliseconds([&] {
      (void)records.attempts(who);
      (void)records.all_metrics(who);
    }));
    cohort.add(milliseconds([&] {
      (void)records.everybody();
      (void)records.attempts();
      (void)records.metrics_at(std::string(64, 'a'), {"metric_number_07"});  // one that has a bar
    }));
  }
  const std::string of = fmt::format("its queries, of {} attempts", attempts);
  report.add(noted(at_most("records.trainee_page.median", trainee.median(), "ms", 50), of));
  report.add(noted(at_most("records.cohort_page.median", cohort.median(), "ms", 50), of));
  const double megabytes = static_cast<double>(std::filesystem::file_size(folder.path() / "lab.db")) / 1e6;
  report.add(at_most("records.size", megabytes, "MB", 100));
}

/// A record store that is gone every second time, or takes statements and nobody hears of it.
class FleetingStore final : public lab::delivery::RecordStore {
public:
  enum class Mood { there, gone, answer_lost };
  lab::delivery::Answer post(const std::string& statements) override {
    if (mood == Mood::gone) return {.body = "gone"};
    auto ids = nlohmann::json::array();
    for (const auto& statement : nlohmann::json::parse(statements)) {
      if (!has.emplace(statement.at("id"), statement.dump()).second) ++known_already;
      ids.push_back(statement.at("id"));
    }
    if (mood == Mood::answer_lost) return {.body = "cut off"};
    return {.http = 200, .body = ids.dump()};
  }
  lab::delivery::Answer get(const std::string& id) override {
    const auto found = has.find(id);
    return found == has.end() ? lab::delivery::Answer{.http = 404}
                              : lab::delivery::Answer{.http = 200, .body = found->second};
  }

  Mood mood = Mood::there;
  std::map<std::string, std::string> has{};
  int known_already = 0;
};

void measure_outbox(Report& report) {
  constexpr int kTimes = 50;
  const Scratch folder;
  lab::store::Lab records({.folder = folder.path(), .build = "bench"});
  records.database().run("PRAGMA synchronous=OFF");
  records.set(lab::store::kHomePage, "https://lab.example/stylet/");
  const lab::store::Person person = records.enrolled("trainee");
  records.set_consent(person.id, lab::store::kRecordStore, true);
  FleetingStore store;
  lab::delivery::Outbox outbox(records.database(), store,
                               {.clock = lab::store::system_ms, .random = [] { return 0.5; }});
  std::set<std::string> told;
  for (int i = 0; i < kTimes; ++i) {
    store.mood = i % 2 == 0 ? FleetingStore::Mood::gone : FleetingStore::Mood::answer_lost;
    const std::string attempt = records.begin(
        {.trainee = person.id,
         .scenario = {.sha256 = std::string(64, 'a'), .name = "liver_biopsy", .title = "Liver biopsy", .text = "[]"},
         .build = "bench"});
    (void)outbox.send();
    records.end(attempt, {.total = 80, .pass_mark = 70, .passed = true});
    (void)outbox.send();
    for (const lab::store::Row& row : records.database().run("SELECT statement FROM outbox")) {
      told.insert(lab::store::text(row[0]));
    }
    store.mood = FleetingStore::Mood::there;
    (void)outbox.send();
  }
  const auto missing = std::ranges::count_if(told, [&](const std::string& id) { return !store.has.contains(id); });
  const std::string of = fmt::format("store gone and back {} times", kTimes);
  report.add(noted(within("outbox.statements", static_cast<double>(store.has.size()), "1", 3.0 * kTimes, 0), of));
  report.add(noted(at_most("outbox.lost", static_cast<double>(missing), "1", 0), of));
  report.add(at_most("outbox.waiting", lab::delivery::outbox_state(records.database()).waiting, "1", 0));
  report.add({"outbox.sent_again", static_cast<double>(store.known_already), "1"});
}

}  // namespace

Report bench_competence(const BenchOptions& options) {
  Report report;
  measure_run_lengths(report, options.quick ? 20000 : 100000);
  measure_published(report);
  measure_certified(report);
  measure_cohorts(report, options.quick ? 2000 : 10000);
  measure_records(report, options.quick ? 500 : 10000);
  measure_kills(report, options.quick ? 20 : 200);
  measure_stations(report, options.quick ? 5 : 50);
  measure_outbox(report);
  return report;
}

}  // namespace stylet::bench
