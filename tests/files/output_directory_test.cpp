#include "engine/files/output_directory.h"

#include "engine/files/error.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <string>

namespace stylet::files {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

void stage(const OutputDirectory& out, const std::string& name, const std::string& text) {
  std::ofstream(out.staged(name)) << text;
}

TEST(OutputDirectory, ABlockedPlaceLeavesTheEarlierResultWhole) {
  const support::TemporaryFolder folder;
  const fs::path to = folder / "out";
  fs::create_directories(to / "m.png" / "inside");  // the place of a picture
  for (const char* name : {"a.png", "z.png", "manifest.json"}) folder.write(std::string("out/") + name, "old");
  {
    OutputDirectory out(to);
    for (const char* name : {"a.png", "m.png", "z.png", "manifest.json"}) stage(out, name, "new");
    out.supersede({"z.png"});
    try {
      out.commit("manifest.json");
      FAIL() << "a folder was written over";
    } catch (const files::ContentError& error) {
      EXPECT_NE(std::string(error.what()).find("m.png: cannot write results here (a folder of this name is there)"),
                std::string::npos)
          << error.what();
    }
  }
  for (const char* name : {"a.png", "z.png", "manifest.json"}) EXPECT_EQ(text_of(to / name), "old") << name;
  EXPECT_EQ(names_in(folder.path()), std::set<std::string>{"out"});
}

// The hidden folder is gone before anybody reads of it.
TEST(OutputDirectory, WhatCannotBeWrittenIsNamedByThePlaceItWasToHave) {
  const support::TemporaryFolder folder;
  const OutputDirectory out(folder / "out");
  const auto message_of = [](const auto& act) -> std::string {
    try {
      act();
    } catch (const std::exception& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  fs::create_directories(out.staged("page.html"));  // in the way
  EXPECT_EQ(message_of([&] { out.write("page.html", "text"); }),
            (folder / "out/page.html").string() + ": cannot be written; is the disk full?");
  const auto writer = [&] { throw std::runtime_error(out.staged("a.png").string() + ": no room"); };
  EXPECT_EQ(message_of([&] { out.named_in_place(writer); }), (folder / "out/a.png").string() + ": no room");
  EXPECT_THROW(out.named_in_place(writer), ContentError);
  // What says nothing of it stays what it was.
  EXPECT_THROW(out.named_in_place([] { throw std::invalid_argument("other"); }), std::invalid_argument);
  EXPECT_THROW(out.named_in_place([] { throw std::range_error("other"); }), std::range_error);
}

TEST(OutputDirectory, WhatIsPublishedStaysThoughTheRestIsNeverCommitted) {
  const support::TemporaryFolder folder;
  const fs::path to = folder / "out";
  {
    OutputDirectory out(to);
    stage(out, "page", "first");
    stage(out, "film", "half of it");
    out.publish({"page"});
    EXPECT_TRUE(fs::exists(to / "page")) << "at once";
    stage(out, "page", "second");
    out.publish({"page"});
  }
  EXPECT_EQ(fs::file_size(to / "page"), 6u);
  EXPECT_FALSE(fs::exists(to / "film"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator{}), 1) << "nothing else";
}

TEST(OutputDirectory, SupersededFilesGoAndStrangersStay) {
  const support::TemporaryFolder folder;
  const fs::path to = folder / "out";
  fs::create_directories(to / "kept");
  for (const char* name : {"0.png", "1.png", "notes.txt", "manifest.json"})
    folder.write(std::string("out/") + name, "old");
  folder.write("secret", "old");
  OutputDirectory out(to);
  out.supersede({"0.png", "1.png", "kept", "../secret", "", "gone.png"});
  stage(out, "0.png", "new");
  stage(out, "manifest.json", "new");
  out.commit("manifest.json");
  EXPECT_EQ(names_in(to), (std::set<std::string>{"0.png", "kept", "manifest.json", "notes.txt"}));
  EXPECT_EQ(text_of(to / "0.png"), "new");
  EXPECT_EQ(text_of(to / "manifest.json"), "new");
  EXPECT_EQ(text_of(folder / "secret"), "old") << "a manifest must not name files elsewhere";
}

}  // namespace
}  // namespace stylet::files
