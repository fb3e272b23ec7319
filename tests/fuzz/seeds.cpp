// Writes what the fuzzers start from: fuzz_seeds DIR makes
// DIR/{gltf,scenario_files,organ_files,link_messages,recording,report_descriptor}/ and DIR/json.dict.
#include "engine/link/message.h"
#include "engine/recording/recording_writer.h"
#include "haptic/hid/force_stylus.h"
#include "tests/gltf/glb.h"

#include <nlohmann/json.hpp>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <iterator>
#include <set>

namespace {

using namespace stylet;
using nlohmann::json;
namespace fs = std::filesystem;

const fs::path kContent = STYLET_SOURCE_DIR "/content";

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write(const fs::path& path, const std::string& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  file << bytes;
}

/// Keys and texts: what a random change would not find.
void collect_words(const json& value, std::set<std::string>& words) {
  if (value.is_string() && value.get_ref<const std::string&>().size() <= 24) words.insert(value.get<std::string>());
  if (value.is_object()) {
    for (const auto& [key, member] : value.items()) {
      if (key.size() <= 32) words.insert(key);
      collect_words(member, words);
    }
  }
  if (value.is_array()) {
    for (const json& element : value) collect_words(element, words);
  }
}

void write_dictionary(const std::set<std::string>& words, const fs::path& path) {
  std::string out;
  for (const std::string& word : words) {
    out += '"';
    for (const char c : "\"" + word + "\"") {
      char escaped[5];
      std::snprintf(escaped, sizeof escaped, "\\x%02X", static_cast<unsigned>(static_cast<unsigned char>(c)));
      out += escaped;
    }
    out += "\"\n";
  }
  write(path, out);
}

/// The shipped JSON files, tracks cut to a few samples.
void write_scenario_files(const fs::path& folder, std::set<std::string>& words) {
  for (const char* name :
       {"scenarios", "needles", "probes", "motions", "organs", "imports", "courses", "tissues.json"}) {
    const fs::path place = kContent / name;
    std::vector<fs::path> files;
    if (fs::is_directory(place)) {
      for (const auto& entry : fs::directory_iterator(place)) files.push_back(entry.path());
    } else {
      files.push_back(place);
    }
    for (const fs::path& file : files) {
      if (file.extension() != ".json") continue;
      json tree = json::parse(read(file));
      if (tree.contains("tracks")) {
        for (auto& [key, track] : tree["tracks"].items()) track.erase(track.begin() + 3, track.end());
      }
      collect_words(tree, words);
      write(folder / (file.parent_path().filename().string() + "_" + file.filename().string()), tree.dump());
    }
  }
}

/// The JSON of a shipped GLB on a binary chunk of one triangle: its structure without its size.
std::string without_geometry(const std::string& glb) {
  gltf::test::Glb out;
  std::uint32_t length = 0;
  std::memcpy(&length, glb.data() + 12, sizeof length);
  out.json = json::parse(glb.substr(20, length));
  out.bin = std::string(36, '\0');
  out.json["buffers"] = {{{"byteLength", out.bin.size()}}};
  for (json& view : out.json["bufferViews"])
    view = {{"buffer", 0}, {"byteOffset", 0}, {"byteLength", out.bin.size()}};
  for (json& accessor : out.json["accessors"]) {
    accessor["count"] = 3;
    accessor["byteOffset"] = 0;
    accessor.erase("min");
    accessor.erase("max");
  }
  return out.bytes();
}

void write_gltf(const fs::path& folder, std::set<std::string>& words) {
  for (const auto& entry : fs::directory_iterator(kContent / "organs")) {
    if (entry.path().extension() == ".glb")
      write(folder / entry.path().filename(), without_geometry(read(entry.path())));
  }
  gltf::test::Glb ball;
  ball.add("liver_ball", gltf::test::sphere({0, 0, 0}, 0.05, 3), {{"id", "liver"}, {"role", "boundary"}},
           {{"preset", "liver"}, {"mechanics", {{"youngsModulus", 5000}}}});
  ball.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  ball.json["nodes"].push_back({{"children", {0}}, {"scale", {1, 2, 1}}, {"translation", {0, 0, 0.1}}});
  ball.json["scenes"][0]["nodes"] = {1};
  collect_words(ball.json, words);
  for (const char* word :
       {"sparse", "indices", "values", "bufferView", "byteStride", "normalized", "rotation", "extensionsRequired",
        "uri", "data:application/octet-stream;base64,", "mode", "VEC2", "MAT4"}) {
    words.insert(word);
  }
  write(folder / "ball.glb", ball.bytes());
}

void write_recording(const fs::path& path) {
  fs::create_directories(path.parent_path());
  recording::RecordingWriter writer(path, {.build = "seed", .scenario = "liver_biopsy", .scenario_hash = 1});
  for (std::uint64_t k = 1; k <= 3; ++k) {
    writer.haptic().add(recording::HapticStepRecord{.step = k, .valid = true, .patch_epoch = 1});
    writer.haptic().add(recording::HashRecord{.step = k, .hash = 77 * k});
  }
  writer.haptic().add_event(0.001, 1, "button",
                            {{"state", std::string_view("pressed")}, {"force", 1.5, "N"}, {"n", std::int64_t{3}}});
  writer.simulation().add(recording::SimulationStepRecord{.step = 1, .factor_requested = true});
  writer.finish();
}

/// A byte that says how to cut them and whether to repair them, then OpenIGTLink messages.
void write_link_messages(const fs::path& folder) {
  const auto save = [&](const char* name, const link::Bytes& bytes) {
    write(folder / name, '\x31' + std::string(bytes.begin(), bytes.end()));
  };
  link::Bytes transform;
  link::append_transform(transform, link::kNeedleName, 1.5, Eigen::Matrix4d::Identity());
  save("transform", transform);
  link::Bytes several;
  const std::vector<std::uint8_t> pixels(8 * 4, 9);
  link::append_image(several, link::kImageName, 1.5, {.width = 8, .height = 4, .pixels = pixels});
  link::append_status(several, link::kStatusName, 1.5, link::Status::ok, "seed");
  several.insert(several.end(), transform.begin(), transform.end());
  save("several", several);
  // Two tools: the names and kinds of the tools lie before their twelve numbers.
  link::Bytes tracking = transform;
  std::memcpy(tracking.data() + 2, "TDATA\0\0\0\0\0", 10);
  tracking[49] = 140;
  for (int tool = 0; tool < 2; ++tool) {
    const std::string name("NeedleToReference\0\0\0\2\0", 22);
    if (tool == 0) tracking.resize(58);
    tracking.insert(tracking.end(), name.begin(), name.end());
    tracking.insert(tracking.end(), transform.begin() + 58, transform.end());
  }
  save("tracking", tracking);
  link::Bytes second = transform;
  second[1] = 2;
  second[49] = 60;
  const link::Bytes extended{0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  second.insert(second.begin() + 58, extended.begin(), extended.end());
  save("version_2", second);
  link::Bytes words;
  link::append_string(words, "CMD_1", 1.5, "scanner gain +2");
  save("command", words);
  link::Bytes plus;
  link::append_string(plus, "CMD_2", 1.5,
                      "<Command Name=\"SetUsParameter\"><Parameter Name=\"DepthMm\" Value=\"150\"/></Command>");
  save("command_of_plus", plus);
}

/// A tetrahedron as STL and OBJ, and a volume of eight voxels.
void write_organ_files(const fs::path& folder, std::set<std::string>& words) {
  write(folder / "text.stl",
        "solid liver SPACE=LPS\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e-1 0\n"
        "endloop\nendfacet\nendsolid\n");
  std::string binary(80 + 4 + 50, '\0');
  binary[80] = 1;
  const std::array corners{0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F};
  std::memcpy(binary.data() + 84 + 12, corners.data(), sizeof corners);
  write(folder / "binary.stl", binary);
  write(folder / "faces.obj",
        "# SPACE=RAS\no liver\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1/1/1 2//2 3\nf -1 -2 -3 -4\n");
  std::string volume(352 + 8, '\0');
  const auto set = [&](std::size_t offset, auto value) { std::memcpy(volume.data() + offset, &value, sizeof value); };
  set(0, std::int32_t{348});
  for (const std::size_t offset : {40u, 42u, 44u, 46u}) set(offset, static_cast<std::int16_t>(offset == 40 ? 3 : 2));
  set(70, std::int16_t{2});
  for (const std::size_t offset : {80u, 84u, 88u, 280u, 300u, 320u}) set(offset, 1.0F);
  set(108, 352.0F);
  set(254, std::int16_t{1});
  std::memcpy(volume.data() + 344, "n+1", 4);
  volume[355] = 7;
  write(folder / "volume.nii", volume);
  for (const char* word : {"solid", "facet", "vertex", "endloop", "endsolid", "SPACE=LPS", "SPACE=RAS"}) {
    words.insert(word);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fputs("usage: fuzz_seeds DIR\n", stderr);
    return 2;
  }
  const fs::path out = argv[1];
  std::set<std::string> words;
  write_scenario_files(out / "scenario_files", words);
  write_gltf(out / "gltf", words);
  write_organ_files(out / "organ_files", words);
  write_link_messages(out / "link_messages");
  write_recording(out / "recording" / "short.rec");
  write(out / "report_descriptor" / "force_stylus.bin",
        {haptic::hid::kForceStylusDescriptor.begin(), haptic::hid::kForceStylusDescriptor.end()});
  write_dictionary(words, out / "json.dict");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "fuzz_seeds: %s\n", error.what());
  return 2;
}
