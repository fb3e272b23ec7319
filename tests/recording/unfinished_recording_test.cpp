#include "engine/recording/unfinished_recording.h"

#include "engine/files/error.h"
#include "engine/recording/recording_writer.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace stylet::recording {
namespace {

namespace fs = std::filesystem;

void fill(const UnfinishedRecording& recording) {
  std::ofstream(recording.path()) << "steps";
}

TEST(UnfinishedRecording, LeavesNothingOfASessionThatNeverBegan) {
  const support::TemporaryFolder folder;
  fill(UnfinishedRecording(folder / "out"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(UnfinishedRecording, StaysInItsFolderWhenTheSessionFails) {
  const support::TemporaryFolder folder;
  fs::path left;
  {
    UnfinishedRecording recording(folder / "out");
    recording.keep();
    fill(recording);
    left = recording.path();
  }
  EXPECT_TRUE(fs::exists(left));
  ASSERT_EQ(cut_off_recordings(folder / "out").size(), 1u);
  EXPECT_EQ(find_recording(folder / "out"), left);

  // The next session there has another, and its results do not take the old one away.
  UnfinishedRecording next(folder / "out");
  next.keep();
  fill(next);
  EXPECT_NE(next.path(), left);
  files::OutputDirectory out(folder / "out");
  next.finish(out, "session.json");
  EXPECT_TRUE(fs::exists(folder / "out/session.rec"));
  EXPECT_FALSE(fs::exists(next.path()));
  EXPECT_TRUE(fs::exists(left));
  EXPECT_EQ(find_recording(folder / "out"), folder / "out/session.rec");
}

TEST(UnfinishedRecording, StaysWhereTheResultsCannotBeCommitted) {
  const support::TemporaryFolder folder;
  fs::create_directories(folder / "out/session.rec/inside");
  UnfinishedRecording recording(folder / "out");
  recording.keep();
  fill(recording);
  files::OutputDirectory out(folder / "out");
  EXPECT_THROW(recording.finish(out, "session.json"), files::ContentError);
  EXPECT_TRUE(fs::exists(recording.path()));
}

TEST(UnfinishedRecording, BeingWrittenIsNotCutOff) {
  const support::TemporaryFolder folder;
  folder.write("unfinished-20260101T000000.000000Z-1.rec", "left by a process, whatever has its number now");
  folder.write("notes-3.rec", "no recording of ours");
  const UnfinishedRecording recording(folder.path());
  {
    const RecordingWriter writer(recording.path(), {});
    ASSERT_EQ(cut_off_recordings(folder.path()).size(), 1u);
    EXPECT_EQ(find_recording(folder.path()).filename(), "unfinished-20260101T000000.000000Z-1.rec");
  }
  EXPECT_EQ(cut_off_recordings(folder.path()).size(), 2u);
  EXPECT_EQ(find_recording(folder.path()), recording.path()) << "the newest";
}

TEST(FindRecording, TakesFilesAsTheyAreAndRefusesAFolderWithoutOne) {
  const support::TemporaryFolder folder;
  EXPECT_EQ(find_recording(folder / "a.rec"), folder / "a.rec");
  EXPECT_THROW(find_recording(folder.path()), files::ContentError);
}

}  // namespace
}  // namespace stylet::recording
