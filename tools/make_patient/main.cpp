// stylet-make-patient: writes the default patient, a tumour for its ablation, a cyst, and the phantom:
// content/organs.

#include "engine/mesh/surface_mesh.h"
#include "tools/make_patient/ablation_case.h"
#include "tools/make_patient/cyst_case.h"
#include "tools/make_patient/patient.h"
#include "tools/make_patient/phantom.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace {

using namespace stylet;

gltf::TissueColours read_colours(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
  gltf::TissueColours colours;
  const nlohmann::json table = nlohmann::json::parse(file);
  for (const auto& [name, tissue] : table.at("tissues").items()) {
    colours[name] = tissue.at("colour").get<std::array<float, 4>>();
  }
  return colours;
}

void write(const std::filesystem::path& path, const char* data, std::size_t size) {
  std::ofstream file(path, std::ios::binary);
  if (!file.write(data, static_cast<std::streamsize>(size))) {
    throw std::runtime_error(fmt::format("{}: cannot be written", path.string()));
  }
}

void print(const std::vector<patient::Organ>& organs) {
  fmt::print("{:<20} {:>8} {:>9} {:>9} {:>6}  {}\n", "node", "faces", "ml", "cm2", "parts", "size, mm");
  for (const patient::Organ& organ : organs) {
    const mesh::SurfaceReport report = mesh::inspect(organ.mesh);
    const Eigen::Vector3d size = report.bounds.sizes() * 1e3;
    fmt::print("{:<20} {:>8} {:>9.1f} {:>9.0f} {:>6}  {:.0f} x {:.0f} x {:.0f}{}\n", organ.name, report.triangles,
               report.volume * 1e6, report.area * 1e4, report.components, size.x(), size.y(), size.z(),
               report.closed() && report.oriented() ? "" : "  NOT CLOSED");
  }
}

/// A glTF file of surfaces made from formulas.
void write_glb(const std::filesystem::path& path, const std::vector<patient::Organ>& organs,
               const gltf::TissueColours& colours, const std::string& scene) {
  const auto glb = gltf::write_glb(
      organs, colours,
      {.generator = "stylet-make-patient", .copyright = "Apache-2.0, Stylet contributors", .scene = scene});
  write(path, reinterpret_cast<const char*>(glb.data()), glb.size());
  print(organs);
  fmt::print("{}: {:.2f} MB\n", path.string(), static_cast<double>(glb.size()) * 1e-6);
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  write(path, text.data(), text.size());
}

int run(int argc, char** argv) {
  CLI::App app{
      "Makes patients from implicit surfaces: DIR/abdomen.glb and .json, the tumour beside a vein and the way to it, "
      "DIR/ablation_tumour.glb and .json, the same for a cyst, DIR/cyst.glb and .json, and the training phantom, "
      "DIR/phantom.glb"};
  std::filesystem::path out = "content/organs";
  std::filesystem::path tissues = "content/tissues.json";
  std::filesystem::path phantom_tissues = "content/phantom_tissues.json";
  app.add_option("--out", out, "folder to write to")->capture_default_str();
  app.add_option("--tissues", tissues, "tissue table: colours of the materials")->capture_default_str();
  app.add_option("--phantom-tissues", phantom_tissues, "the same of the phantom")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  std::filesystem::create_directories(out);
  write_glb(out / "abdomen.glb", patient::make_organs(), read_colours(tissues), "abdomen");
  write_text(out / "abdomen.json", patient::procedure_json(patient::make_procedure()));
  write_glb(out / "ablation_tumour.glb", patient::make_ablation_tumour(), read_colours(tissues), "ablation_tumour");
  write_text(out / "ablation_tumour.json",
             patient::procedure_json(patient::make_ablation_procedure(), "ablation_tumour.glb", "ablation_tumour"));
  write_glb(out / "cyst.glb", patient::make_cyst(), read_colours(tissues), "cyst");
  write_text(out / "cyst.json", patient::procedure_json(patient::make_cyst_procedure(), "cyst.glb", "cyst"));
  write_glb(out / "phantom.glb", patient::make_phantom(), read_colours(phantom_tissues), "phantom");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "stylet-make-patient: %s\n", error.what());
    return 2;
  }
}
