// `stylet lab` and `stylet train --trainee` at a station of a lab's PostgreSQL server.
#include "tests/readers/small_scenario.h"
#include "tests/stylet/command.h"
#include "tests/support/postgres_database.h"
#include "tests/support/temporary_folder.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace stylet {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class LabServerCommand : public ::testing::Test {
protected:
  LabServerCommand() {
    ::unsetenv("STYLET_LAB_DATABASE");
    small_.scenario["labels"]["spacing_mm"] = 4;
    small_.write();
  }
  ~LabServerCommand() override { ::unsetenv("STYLET_LAB_DATABASE"); }
  Outcome act(const std::string& arguments, const std::string& station = "one") const {
    return run(fmt::format("lab {} --lab {}", arguments, (folder_ / station).string()));
  }
  Outcome train() const {
    return run(
        fmt::format("train {} --device recorded --view headless --no-film --expert none --lockstep --seconds 0.2 "
                    "--out {} --lab {} --trainee 'Ada L'",
                    small_.path().string(), (folder_ / "out").string(), (folder_ / "one").string()));
  }

  support::TemporaryFolder folder_;
  readers::test::SmallScenario small_;
};

TEST_F(LabServerCommand, AServerThatIsAwayIsOneLineWithoutAPassword) {
  const Outcome away = act("list --database postgresql://lab:secret@127.0.0.1:1/lab");
  EXPECT_EQ(away.exit_code, 2);
  EXPECT_EQ(away.lines(), 1) << away.output;
  EXPECT_THAT(away.output, HasSubstr("cannot be reached"));
  EXPECT_THAT(away.output, HasSubstr("--database own"));
  EXPECT_EQ(act("hand-over --database postgresql://lab:secret@127.0.0.1:1/lab").exit_code, 2);
  const Outcome kept = act("join --database postgresql://lab:secret@127.0.0.1:1/lab");
  EXPECT_EQ(kept.exit_code, 2);
  EXPECT_THAT(kept.output, HasSubstr(".pgpass"));
  for (const Outcome& said : {away, kept}) EXPECT_THAT(said.output, Not(HasSubstr("secret")));
  EXPECT_THAT(act("join").output, HasSubstr("--off"));
  EXPECT_THAT(act("hand-over").output, HasSubstr("no server"));
  EXPECT_EQ(act("list").exit_code, 0);
}

TEST_F(LabServerCommand, ASessionWithoutItsServerIsKeptAndHandedOverToAllStations) {
  const auto server = support::test_postgres();
  if (!server) GTEST_SKIP() << "STYLET_TEST_POSTGRES is not set";
  const support::PostgresTestDatabase database(*server);
  ::setenv("STYLET_LAB_DATABASE", "postgresql://lab@127.0.0.1:1/lab", 1);
  const Outcome trained = train();
  EXPECT_EQ(trained.exit_code, 0) << trained.output;
  EXPECT_THAT(trained.output, HasSubstr("attempts stay on this computer until the lab's server is there"));
  ::unsetenv("STYLET_LAB_DATABASE");
  EXPECT_THAT(act("list").output, HasSubstr("Ada L"));
  const Outcome joined = act("join --database '" + database.address() + "'");
  EXPECT_EQ(joined.exit_code, 0) << joined.output;
  EXPECT_THAT(joined.output, HasSubstr("1 attempts and 1 new people"));
  EXPECT_THAT(act("hand-over").output, HasSubstr("has everything"));
  // Another station sees it; a session there now goes to the server by itself.
  EXPECT_THAT(act("list --database '" + database.address() + "'", "two").output, HasSubstr("Ada L"));
  const Outcome again = train();
  EXPECT_EQ(again.exit_code, 0) << again.output;
  EXPECT_THAT(again.output, HasSubstr("1 attempts and 0 new people"));
  const std::string more = database.address().find('?') == std::string::npos ? "?" : "&";
  const Outcome seen = act("list --database '" + database.address() + more + "password=seen'", "two");
  EXPECT_THAT(seen.output, HasSubstr("~/.pgpass")) << "what the list of processes shows is said";
  ::setenv("STYLET_LAB_DATABASE", database.address().c_str(), 1);
  const Outcome shown = act("show 'Ada L'", "two");
  EXPECT_EQ(shown.exit_code, 0) << shown.output;
  EXPECT_EQ(act("export", "two").lines(), 3);
  EXPECT_EQ(act("erase 'Ada L' --yes", "two").exit_code, 0);
  ::unsetenv("STYLET_LAB_DATABASE");
  const Outcome forgotten = act("list");
  EXPECT_THAT(forgotten.output, HasSubstr("1 people were erased there"));
  EXPECT_THAT(act("list --database own").output, HasSubstr("Nobody is in"));
  EXPECT_EQ(act("join --off").exit_code, 0);
}

}  // namespace
}  // namespace stylet
