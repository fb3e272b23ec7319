// What a bench measured: a list of named numbers beside the figure of the paper and the bound asked for.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stylet::bench {

/// One number. Names are stable, dotted, from the general to the special: "table1.total.constraints.median".
struct Measurement {
  std::string name;
  double value = 0;
  std::string unit;                   ///< as printed: "us", "N", "1" for ratios and counts
  std::optional<double> reference{};  ///< the paper's or the theory's figure, same unit
  std::string target{};               ///< the bound asked for, as text; empty: none
  std::optional<bool> met{};          ///< whether the target is met; nothing where there is no target
  std::string note{};                 ///< how it was measured, where the name does not say
};

/// A measurement with a bound, judged. A value that is not a number misses every bound.
Measurement at_most(std::string name, double value, std::string unit, double bound,
                    std::optional<double> reference = {});
Measurement at_least(std::string name, double value, std::string unit, double bound,
                     std::optional<double> reference = {});

/// The target is `reference` itself, give or take `tolerance`.
Measurement within(std::string name, double value, std::string unit, double reference, double tolerance);
Measurement noted(Measurement measurement, std::string note);

/// A picture of what was measured.
struct Figure {
  std::string title;
  std::string caption;
  std::filesystem::path file;  ///< PNG
};

/// What a bench hands back, in the order of printing.
struct Report {
  std::vector<Measurement> measurements;
  std::vector<Figure> figures{};

  void add(Measurement measurement) { measurements.push_back(std::move(measurement)); }
  void append(const Report& other);
  /// Targets that were missed.
  int missed() const;
};

/// Where a bench ran. Numbers without it say nothing.
struct Machine {
  std::string processor;
  int cores = 0;
  double memory_gib = 0;
  std::string build;     ///< version and commit
  std::string compiler;  ///< with version
  std::string flags;
  std::string blas;
};

/// This machine and this build. Sets BLAS to one thread.
/// @param build  version and commit, which only the program knows
Machine this_machine(std::string build);

/// A flat list of {"name","value","unit","reference","target","met"}, null where there is none (and for a value that
/// is not finite), and "note" where there is one.
std::string to_json(const Report& report);

/// The same for people: machine, then one line a measurement, missed targets marked MISSED and counted at the end.
std::string to_table(const Report& report, const Machine& machine);

/// The same as a page for a browser, with its figures in it: one file that can be sent.
/// @throws std::runtime_error if a figure cannot be read or the file not be written
void write_page(const std::filesystem::path& file, const std::string& title, const Report& report,
                const Machine& machine);

}  // namespace stylet::bench
