// A session as a command line describes it.
#pragma once

#include "engine/app/run_session.h"
#include "tools/stylet/session_options.h"

#include <CLI/CLI.hpp>

#include <string>

namespace stylet::tools {

struct TrainOptions {
  app::SessionSettings session{};
  std::string view = "auto";
  LinkOptions link{};
  bool ask_trainee = false;  ///< where the lab has names
};

/// All but scenario, trainee and course.
void add_session_options(CLI::App& command, TrainOptions& options);
/// Runs it and says what it has left. @return exit code
int run_training(const TrainOptions& options);

}  // namespace stylet::tools
