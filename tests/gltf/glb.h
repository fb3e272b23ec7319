// Small glTF files made in memory, and temporary folders to put files in.
#pragma once

#include "engine/mesh/triangle_mesh.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace stylet::gltf::test {

/// A latitude-longitude sphere, outward, closed.
inline mesh::TriangleMesh sphere(const Eigen::Vector3d& centre, double radius, std::uint32_t rings = 16) {
  mesh::TriangleMesh mesh;
  const std::uint32_t sectors = 2 * rings;
  mesh.vertices.push_back(centre + Eigen::Vector3d(0, 0, radius));
  for (std::uint32_t i = 1; i < rings; ++i) {
    for (std::uint32_t j = 0; j < sectors; ++j) {
      const double a = std::numbers::pi * i / rings;
      const double b = 2 * std::numbers::pi * j / sectors;
      mesh.vertices.push_back(
          centre + radius * Eigen::Vector3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)));
    }
  }
  mesh.vertices.push_back(centre - Eigen::Vector3d(0, 0, radius));
  const auto south = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  const auto at = [&](std::uint32_t i, std::uint32_t j) { return 1 + (i - 1) * sectors + j % sectors; };
  for (std::uint32_t j = 0; j < sectors; ++j) {
    mesh.triangles.push_back({0, at(1, j), at(1, j + 1)});
    for (std::uint32_t i = 1; i + 1 < rings; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
    mesh.triangles.push_back({at(rings - 1, j), south, at(rings - 1, j + 1)});
  }
  return mesh;
}

/// A GLB in the making: edit `json`, then bytes().
struct Glb {
  nlohmann::json json = {
      {"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", nlohmann::json::array()}}}}};
  std::string bin;

  /// Adds a node with a mesh, its material carrying `tissue`, the node carrying `organ`.
  std::size_t add(const std::string& name, const mesh::TriangleMesh& mesh, const nlohmann::json& organ = nullptr,
                  const nlohmann::json& tissue = nullptr) {
    const auto index = [&](const char* list) { return json.contains(list) ? json[list].size() : 0; };
    const std::size_t positions = view(mesh.vertices.size() * 12);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      const Eigen::Vector3f p = mesh.vertices[i].cast<float>();
      std::memcpy(bin.data() + bin.size() - 12 * (mesh.vertices.size() - i), p.data(), 12);
    }
    const std::size_t indices = view(mesh.triangles.size() * 12);
    std::memcpy(bin.data() + bin.size() - 12 * mesh.triangles.size(), mesh.triangles.data(),
                12 * mesh.triangles.size());
    const std::size_t accessor = index("accessors");
    json["accessors"].push_back(
        {{"bufferView", positions}, {"componentType", 5126}, {"count", mesh.vertices.size()}, {"type", "VEC3"}});
    json["accessors"].push_back(
        {{"bufferView", indices}, {"componentType", 5125}, {"count", 3 * mesh.triangles.size()}, {"type", "SCALAR"}});
    nlohmann::json primitive = {{"attributes", {{"POSITION", accessor}}}, {"indices", accessor + 1}};
    if (!tissue.is_null()) {
      primitive["material"] = index("materials");
      json["materials"].push_back({{"name", name}, {"extras", {{"tissue", tissue}}}});
    }
    nlohmann::json node = {{"name", name}, {"mesh", index("meshes")}};
    if (!organ.is_null()) node["extras"] = {{"organ", organ}};
    json["meshes"].push_back({{"primitives", nlohmann::json::array({primitive})}});
    const std::size_t number = index("nodes");
    json["nodes"].push_back(node);
    json["scenes"][0]["nodes"].push_back(number);
    return number;
  }

  std::string bytes() const {
    nlohmann::json document = json;
    if (!bin.empty() && !document.contains("buffers")) document["buffers"] = {{{"byteLength", bin.size()}}};
    std::string text = document.dump();
    text.append((4 - text.size() % 4) % 4, ' ');
    std::string out = "glTF";
    const auto word = [&](std::size_t value) {
      const auto v = static_cast<std::uint32_t>(value);
      out.append(reinterpret_cast<const char*>(&v), 4);
    };
    word(2);
    word(12 + 8 + text.size() + 8 + bin.size());
    word(text.size());
    out += "JSON" + text;
    word(bin.size());
    out += std::string("BIN\0", 4) + bin;
    return out;
  }

private:
  std::size_t view(std::size_t bytes) {
    const std::size_t number = json.contains("bufferViews") ? json["bufferViews"].size() : 0;
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes}});
    bin.append(bytes, '\0');
    return number;
  }
};

inline std::span<const std::byte> as_bytes(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

}  // namespace stylet::gltf::test
