// glTF from memory: a scene within its limits, or one line.
#include "engine/gltf/gltf.h"
#include "tests/fuzz/claim.h"
#include "tests/fuzz/libfuzzer.h"

#include <algorithm>
#include <cstring>
#include <random>
#include <span>

namespace {

using namespace stylet;

constexpr std::size_t kJsonAt = 20;  // behind the header and the front of the first chunk
constexpr gltf::GltfLimits kLimits{.file_bytes = 1u << 20, .elements = 100'000, .instances = 1000};

std::uint32_t word(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

void set_word(std::string& bytes, std::size_t at, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  std::memcpy(bytes.data() + at, &word, sizeof word);
}

void claim_sound(const gltf::GltfScene& scene) {
  std::size_t vertices = 0;
  for (const gltf::GltfOrgan& organ : scene.organs) {
    for (const Eigen::Vector3d& vertex : organ.mesh.vertices) {
      fuzz::claim(vertex.allFinite() && vertex.cwiseAbs().maxCoeff() <= kLimits.coordinate_m,
                  "vertices are in range");
    }
    for (const auto& triangle : organ.mesh.triangles) {
      fuzz::claim(std::ranges::max(triangle) < organ.mesh.vertices.size(), "indices are in range");
    }
    vertices += organ.mesh.vertices.size();
  }
  fuzz::claim(vertices <= kLimits.elements, "the file's elements are limited");
  for (const std::string& warning : scene.warnings) fuzz::claim_one_line(warning);
  for (const std::string& key : scene.unknown_annotations) fuzz::claim_one_line(key);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    claim_sound(gltf::read_gltf(std::as_bytes(std::span(data, size)), "fuzz.glb", kLimits));
  } catch (const files::ContentError& error) {
    fuzz::claim_one_line(error.what());
  }
  return 0;
}

// Mostly the JSON or the binary chunk changes and the frame round them is made to fit: it gets further.
std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  std::minstd_rand random(seed);
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const bool framed = size >= kJsonAt && word(bytes, 12) <= size - kJsonAt;
  if (!framed || random() % 8 == 0) return LLVMFuzzerMutate(data, size, max_size);
  std::string json(bytes.substr(kJsonAt, word(bytes, 12)));
  std::string rest(bytes.substr(kJsonAt + json.size()));  // the binary chunk and what follows
  std::string& changed = rest.size() > 8 && random() % 4 == 0 ? rest : json;
  fuzz::mutate(changed, 64);
  json.append((4 - json.size() % 4) % 4, ' ');
  if (rest.size() >= 8) set_word(rest, 0, rest.size() - 8);
  std::string out(bytes.substr(0, kJsonAt));
  out += json;
  out += rest;
  if (out.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  set_word(out, 8, out.size());
  set_word(out, 12, json.size());
  std::memcpy(data, out.data(), out.size());
  return out.size();
}
