// The house against its map: every #include of a room is allowed by the table in engine/README.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace stylet::tests {
namespace {

namespace fs = std::filesystem;
using Graph = std::map<std::string, std::set<std::string>>;

const fs::path kRoot = STYLET_SOURCE_DIR;
const std::string kEverything = "everything";

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Room by room, those it may know: the table of engine/README.md.
Graph allowed() {
  Graph graph;
  std::istringstream map(text_of(kRoot / "engine/README.md"));
  static const std::regex kRow(R"(^\| `([a-z_/]+)` \|[^|]*\|([^|]*)\|$)");
  static const std::regex kRoom(R"(`([a-z_/]+)`)");
  for (std::string line; std::getline(map, line);) {
    std::smatch row;
    if (!std::regex_match(line, row, kRow)) continue;
    std::set<std::string>& rooms = graph[row[1]];
    const std::string cell = row[2];
    if (cell.find(kEverything) != std::string::npos) rooms.insert(kEverything);
    for (std::sregex_iterator name(cell.begin(), cell.end(), kRoom), end; name != end; ++name) {
      rooms.insert((*name)[1]);
    }
  }
  return graph;
}

struct Include {
  std::string file;  ///< from the root
  std::string room;  ///< of the file
  std::string of;    ///< room of what it includes
};

/// Every include of another room's header, by full path from the root, in physics, haptic, engine and tools.
std::vector<Include> includes() {
  static const std::regex kInclude(R"re(^#include "([a-z_/]+)/[^/"]+")re", std::regex::multiline);
  std::vector<Include> found;
  for (const char* top : {"physics", "haptic", "engine", "tools"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / top)) {
      const std::string extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      const fs::path file = fs::relative(entry.path(), kRoot);
      const std::string text = text_of(entry.path());
      for (std::sregex_iterator match(text.begin(), text.end(), kInclude), end; match != end; ++match) {
        found.push_back({.file = file, .room = file.parent_path(), .of = (*match)[1]});
      }
    }
  }
  return found;
}

TEST(Rooms, IncludeOnlyThoseThatTheMapAllows) {
  const Graph map = allowed();
  for (const Include& include : includes()) {
    if (include.of == include.room) continue;
    const auto row = map.find(include.room);
    ASSERT_NE(row, map.end()) << include.room << " has no row in engine/README.md";
    EXPECT_TRUE(row->second.contains(include.of) || row->second.contains(kEverything))
        << include.file << " includes " << include.of << ", which the table in engine/README.md does not allow "
        << include.room;
  }
}

TEST(Rooms, UseEverythingThatTheMapAllows) {
  Graph used;
  for (const Include& include : includes()) used[include.room].insert(include.of);
  for (const auto& [room, rooms] : allowed()) {
    EXPECT_TRUE(fs::is_directory(kRoot / room)) << room << " has a row but no folder";
    for (const std::string& other : rooms) {
      EXPECT_TRUE(other == kEverything || used[room].contains(other))
          << room << " includes nothing of " << other << ": take it out of its row in engine/README.md";
    }
  }
}

TEST(Rooms, KnowEachOtherWithoutACircle) {
  Graph left = allowed();
  for (auto& [room, rooms] : left) {
    std::erase_if(rooms, [&](const std::string& other) { return !left.contains(other); });
  }
  for (bool progress = true; progress;) {
    progress = false;
    for (auto row = left.begin(); row != left.end();) {
      if (!row->second.empty()) {
        ++row;
        continue;
      }
      for (auto& [room, rooms] : left) rooms.erase(row->first);
      row = left.erase(row);
      progress = true;
    }
  }
  for (const auto& [room, rooms] : left) ADD_FAILURE() << room << " knows itself through " << *rooms.begin();
}

TEST(Rooms, AreLibrariesOfTheirNames) {
  for (const auto& [room, rooms] : allowed()) {
    if (!room.starts_with("engine/")) continue;
    const std::string library = "stylet_library(stylet_" + fs::path(room).filename().string();
    EXPECT_NE(text_of(kRoot / room / "CMakeLists.txt").find(library), std::string::npos)
        << room << "/CMakeLists.txt does not make " << library;
  }
}

TEST(Rooms, HaveNamespacesOfTheirNames) {
  static const std::regex kNamespace(R"(^namespace stylet::([a-z_:]+) \{)", std::regex::multiline);
  for (const auto& [room, rooms] : allowed()) {
    if (!room.starts_with("engine/")) continue;
    // engine/procedures/biopsy: procedures::biopsy; what all of them share lies in procedures.
    std::string name = room.substr(std::string("engine/").size());
    if (const std::size_t slash = name.find('/'); slash != std::string::npos) name.replace(slash, 1, "::");
    if (name == "procedures::interface") name = "procedures";
    for (const fs::directory_entry& entry : fs::directory_iterator(kRoot / room)) {
      if (entry.path().extension() != ".h") continue;
      const std::string text = text_of(entry.path());
      std::smatch match;
      if (!std::regex_search(text, match, kNamespace)) continue;
      EXPECT_TRUE(match[1] == name || match[1].str().starts_with(name + "::"))
          << entry.path() << " is in namespace stylet::" << match[1] << " but in the room " << room;
    }
  }
}

/// GLFW's functions, types and constants.
bool uses_window_library(const std::string& text) {
  static const std::regex kName(R"(^(<GLFW/|GLFW_|GLFWwindow|glfw[A-Z]).*)");
  for (std::size_t at = 0; (at = std::min(text.find("GLFW", at), text.find("glfw", at))) != std::string::npos; ++at) {
    if (std::regex_match(text.substr(at > 0 && text[at - 1] == '<' ? at - 1 : at, 12), kName)) return true;
  }
  return false;
}

/// A key by GLFW's number for it, 256 (Escape) to 348 (Menu): `kHome = 268`, `key == 257`.
bool has_number_of_a_key(const std::string& text) {
  static const std::regex kBefore(
      R"(.*(Key|key|Enter|Tab|Backspace|Home|End|Right|Left|Up|Down|F\d) *(=|==|!=|\{|\() *)");
  for (std::size_t at = text.find_first_of("23"); at != std::string::npos; at = text.find_first_of("23", at + 1)) {
    const std::size_t end = std::min(text.find_first_not_of("0123456789", at), text.size());
    if (end - at != 3 || at < 30) continue;
    const int number = std::stoi(text.substr(at, 3));
    if (number < 256 || number > 348) continue;
    const std::string before = text.substr(at - 30, 30);
    if (std::regex_match(before.substr(before.rfind('\n') + 1), kBefore)) return true;
  }
  return false;
}

TEST(Rooms, KnowTheWindowLibraryOnlyInTheWindow) {
  const std::string some_code(30, ' ');
  EXPECT_TRUE(uses_window_library("#include <GLFW/glfw3.h>"));
  EXPECT_TRUE(uses_window_library("x = glfwInit();"));
  EXPECT_FALSE(uses_window_library("// no code of GLFW"));
  EXPECT_TRUE(has_number_of_a_key(some_code + "constexpr int kHomeKey = 268;"));
  EXPECT_TRUE(has_number_of_a_key(some_code + "if (key == 257) start();"));
  EXPECT_FALSE(has_number_of_a_key(some_code + "keys = 12; width = 320;"));
  int in_window = 0;
  for (const char* top : {"physics", "haptic", "engine", "tools", "tests"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / top)) {
      const std::string extension = entry.path().extension();
      const fs::path file = fs::relative(entry.path(), kRoot);
      if ((extension != ".h" && extension != ".cpp") || file == "tests/rooms/rooms_test.cpp") continue;
      const std::string text = text_of(entry.path());
      if (file == "engine/view/window.cpp" || file == "engine/view/window.h") {
        in_window += uses_window_library(text) ? 1 : 0;
        continue;
      }
      EXPECT_FALSE(uses_window_library(text)) << file << " uses GLFW; only engine/view/window may";
      EXPECT_FALSE(has_number_of_a_key(text)) << file << " has a key by its number in GLFW; use view::Key";
    }
  }
  EXPECT_EQ(in_window, 2);
}

}  // namespace
}  // namespace stylet::tests
