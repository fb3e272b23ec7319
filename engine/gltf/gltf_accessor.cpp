#include "engine/gltf/gltf_accessor.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace stylet::gltf {
namespace {

std::size_t component_size(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

template <typename T>
double load(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);  // views need not be aligned
  return static_cast<double>(value);
}

double load_component(const std::byte* from, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return load<std::int8_t>(from);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return load<std::uint8_t>(from);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return load<std::int16_t>(from);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(from);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return load<std::uint32_t>(from);
    default:
      return load<float>(from);
  }
}

/// glTF 2.0, 3.6.2.2: signed and unsigned normalised integers.
double normalise(double value, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return std::max(value / 127.0, -1.0);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return value / 255.0;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return std::max(value / 32767.0, -1.0);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return value / 65535.0;
    default:
      return value;
  }
}

}  // namespace

AccessorReader::AccessorReader(const tinygltf::Model& model, GltfBuffers& buffers, std::string file,
                               const GltfLimits& limits)
    : model_(model), buffers_(buffers), file_(std::move(file)), limits_(limits) {}

void AccessorReader::fail(const std::string& place, const std::string& what) const {
  throw files::ContentError(fmt::format("{}:/{}: {}", file_, place, what));
}

AccessorReader::Layout AccessorReader::layout(int index) const {
  const std::string place = fmt::format("accessors/{}", index);
  if (index < 0 || static_cast<std::size_t>(index) >= model_.accessors.size()) {
    fail(place, fmt::format("there is no such accessor, the file has {}; export it again", model_.accessors.size()));
  }
  const auto& accessor = model_.accessors[index];
  Layout layout{.component_type = accessor.componentType,
                .components = accessor.type == TINYGLTF_TYPE_SCALAR ? 1
                              : accessor.type == TINYGLTF_TYPE_VEC3 ? 3
                                                                    : 0,
                .component_bytes = component_size(accessor.componentType),
                .count = accessor.count,
                .normalised = accessor.normalized};
  if (layout.component_bytes == 0) {
    fail(place + "/componentType",
         fmt::format("{} is not a glTF 2.0 component type; export it again", accessor.componentType));
  }
  if (layout.count == 0 || layout.count > limits_.elements) {
    fail(place + "/count", fmt::format("is {}, accepted is 1 to {}; decimate the mesh or export it again",
                                       layout.count, limits_.elements));
  }
  return layout;
}

const std::byte* AccessorReader::elements(int view_index, std::size_t offset, std::size_t count, std::size_t bytes,
                                          std::size_t& stride, const std::string& place) const {
  if (view_index < 0 || static_cast<std::size_t>(view_index) >= model_.bufferViews.size()) {
    fail(place + "/bufferView",
         fmt::format("is {}, the file has {} buffer views; export it again", view_index, model_.bufferViews.size()));
  }
  const auto& view = model_.bufferViews[view_index];
  const std::string view_place = fmt::format("bufferViews/{}", view_index);
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= buffers_.size()) {
    fail(view_place + "/buffer",
         fmt::format("is {}, the file has {} buffers; export it again", view.buffer, buffers_.size()));
  }
  const std::span<const std::byte> data = buffers_.bytes(static_cast<std::size_t>(view.buffer));
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset) {
    fail(view_place, fmt::format("offset {} and length {} leave the buffer of {} bytes; the file is cut off or wrong",
                                 view.byteOffset, view.byteLength, data.size()));
  }
  if (stride == 0) stride = view.byteStride;
  if (stride == 0) {
    stride = bytes;
  } else if (stride != bytes && (stride < 4 || stride > 252 || stride % 4 != 0 || stride < bytes)) {
    fail(view_place + "/byteStride",
         fmt::format("is {}, accepted is a multiple of 4 from {} to 252; export it again", stride, bytes));
  }
  // count <= limits.elements and stride <= 252, so nothing wraps.
  if (offset > view.byteLength || stride * (count - 1) + bytes > view.byteLength - offset) {
    fail(place, fmt::format("{} elements from byte {} leave their view of {} bytes; the file is cut off or wrong",
                            count, offset, view.byteLength));
  }
  return data.data() + view.byteOffset + offset;
}

std::vector<double> AccessorReader::values(int index, const Layout& layout) const {
  const auto& accessor = model_.accessors[index];
  const std::string place = fmt::format("accessors/{}", index);
  const std::size_t row = static_cast<std::size_t>(layout.components);
  const std::size_t bytes = layout.component_bytes * row;
  std::vector<double> out(layout.count * row, 0.0);

  const auto read = [&](const std::byte* from, std::size_t element) {
    for (std::size_t c = 0; c < row; ++c) {
      const double value = load_component(from + c * layout.component_bytes, layout.component_type);
      out[element * row + c] = layout.normalised ? normalise(value, layout.component_type) : value;
    }
  };

  if (accessor.bufferView != -1) {
    std::size_t stride = 0;
    const std::byte* first = elements(accessor.bufferView, accessor.byteOffset, layout.count, bytes, stride, place);
    for (std::size_t i = 0; i < layout.count; ++i) read(first + i * stride, i);
  }

  if (accessor.sparse.isSparse) {
    const auto& sparse = accessor.sparse;
    if (sparse.count < 1 || static_cast<std::size_t>(sparse.count) > layout.count) {
      fail(place + "/sparse/count", fmt::format("is {}, accepted is 1 to {}", sparse.count, layout.count));
    }
    if (sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0) {
      fail(place + "/sparse", "has a negative byteOffset; export it again");
    }
    const int index_type = sparse.indices.componentType;
    const std::size_t index_bytes = component_size(index_type);
    if (index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
        index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) {
      fail(place + "/sparse/indices/componentType", "is not an unsigned integer; export it again");
    }
    const std::size_t count = static_cast<std::size_t>(sparse.count);
    std::size_t index_stride = index_bytes;
    std::size_t value_stride = bytes;
    const std::byte* indices =
        elements(sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count, index_bytes,
                 index_stride, place + "/sparse/indices");
    const std::byte* values = elements(sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset),
                                       count, bytes, value_stride, place + "/sparse/values");
    double previous = -1;
    for (std::size_t i = 0; i < count; ++i) {
      const double element = load_component(indices + i * index_stride, index_type);
      if (element <= previous || element >= static_cast<double>(layout.count)) {
        fail(place + "/sparse/indices",
             fmt::format("element {} is {}: not increasing or not below {}", i, element, layout.count));
      }
      previous = element;
      read(values + i * value_stride, static_cast<std::size_t>(element));
    }
  }
  return out;
}

std::vector<Eigen::Vector3d> AccessorReader::positions(int index, bool quantised) const {
  const Layout layout = this->layout(index);
  const bool is_float = layout.component_type == TINYGLTF_COMPONENT_TYPE_FLOAT;
  const bool is_short = layout.component_bytes < 4;
  if (layout.components != 3 || !(is_float || (quantised && is_short))) {
    fail(fmt::format("accessors/{}", index),
         "POSITION is not three floats (or small integers with KHR_mesh_quantization); export positions as floats");
  }
  const std::vector<double> numbers = values(index, layout);
  std::vector<Eigen::Vector3d> out(layout.count);
  for (std::size_t i = 0; i < layout.count; ++i) {
    out[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
    if (!out[i].allFinite()) {
      fail(fmt::format("accessors/{}", index), fmt::format("position {} is not finite; repair the mesh", i));
    }
  }
  return out;
}

std::vector<std::uint32_t> AccessorReader::indices(int index, std::size_t vertex_count) const {
  const Layout layout = this->layout(index);
  const int type = layout.component_type;
  if (layout.components != 1 ||
      (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
       type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)) {
    fail(fmt::format("accessors/{}", index), "indices are not unsigned integer scalars; export it again");
  }
  const double restart = std::ldexp(1.0, static_cast<int>(8 * layout.component_bytes)) - 1;
  Layout raw = layout;
  raw.normalised = false;
  const std::vector<double> numbers = values(index, raw);
  std::vector<std::uint32_t> out(layout.count);
  for (std::size_t i = 0; i < layout.count; ++i) {
    if (numbers[i] >= static_cast<double>(vertex_count) || numbers[i] == restart) {
      fail(fmt::format("accessors/{}", index),
           fmt::format("index {} is {}, the mesh has {} vertices; repair the mesh", i, numbers[i], vertex_count));
    }
    out[i] = static_cast<std::uint32_t>(numbers[i]);
  }
  return out;
}

}  // namespace stylet::gltf
