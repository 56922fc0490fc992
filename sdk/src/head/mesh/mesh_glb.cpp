// glTF 2.0 in one file (Khronos, glTF 2.0 specification, 4.4): a header, a chunk of JSON, a chunk of bytes.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "head/mesh/file_axes.h"
#include "head/mesh/mesh_files.h"

namespace maq::head {
namespace {

using nlohmann::json;

enum ComponentType { kUnsignedByte = 5121, kUnsignedInt = 5125, kFloat = 5126 };
enum BufferTarget { kNoTarget = 0, kVertices = 34962, kIndices = 34963 };

void append_word(std::vector<uint8_t>& to, uint32_t word) {
  const auto* const bytes = reinterpret_cast<const uint8_t*>(&word);  // every system of the SDK is little endian
  to.insert(to.end(), bytes, bytes + sizeof word);
}

// Braces around one value are that value to some compilers, and a list to others.
json array_of(json value) {
  json made = json::array();
  made.push_back(std::move(value));
  return made;
}

class GlbWriter {
 public:
  // The number of the accessor.
  template <class T>
  size_t add_accessor(const std::vector<T>& values, size_t each, ComponentType type, BufferTarget target) {
    static constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    json accessor = {{"bufferView", add_view(values.data(), values.size() * sizeof(T), target)},
                     {"componentType", int(type)},
                     {"count", values.size() / each},
                     {"type", kTypes[each]}};
    if (type == kUnsignedByte) accessor["normalized"] = true;
    json& accessors = file_["accessors"];
    accessors.push_back(std::move(accessor));
    return accessors.size() - 1;
  }

  size_t add_view(const void* data, size_t bytes, BufferTarget target) {
    json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes}};
    if (target != kNoTarget) view["target"] = int(target);
    bytes_.insert(bytes_.end(), static_cast<const uint8_t*>(data), static_cast<const uint8_t*>(data) + bytes);
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    json& views = file_["bufferViews"];
    views.push_back(std::move(view));
    return views.size() - 1;
  }

  json& file() { return file_; }

  std::vector<uint8_t> finish() {
    file_["buffers"] = array_of({{"byteLength", bytes_.size()}});
    std::string text = file_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::vector<uint8_t> made;
    made.reserve(28 + text.size() + bytes_.size());
    append_word(made, 0x46546C67);  // glTF
    append_word(made, 2);
    append_word(made, uint32_t(28 + text.size() + bytes_.size()));
    append_word(made, uint32_t(text.size()));
    append_word(made, 0x4E4F534A);  // JSON
    made.insert(made.end(), text.begin(), text.end());
    append_word(made, uint32_t(bytes_.size()));
    append_word(made, 0x004E4942);  // BIN
    made.insert(made.end(), bytes_.begin(), bytes_.end());
    return made;
  }

 private:
  json file_ = json::object();
  std::vector<uint8_t> bytes_;
};

// sRGB to linear light (IEC 61966-2-1), both 0 to 255.
std::array<uint8_t, 256> linear_bytes() {
  std::array<uint8_t, 256> made{};
  for (size_t i = 0; i < made.size(); ++i) {
    const double value = double(i) / 255;
    const double linear = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    made[i] = uint8_t(std::lround(255 * linear));
  }
  return made;
}

// Four bytes a vertex: vertices must begin at multiples of four.
std::vector<uint8_t> linear_colours(const std::vector<uint8_t>& colours) {
  const auto linear = linear_bytes();
  std::vector<uint8_t> made;
  made.reserve(colours.size() / 3 * 4);
  for (size_t i = 0; i < colours.size(); ++i) {
    made.push_back(linear[colours[i]]);
    if (i % 3 == 2) made.push_back(255);
  }
  return made;
}

}  // namespace

std::vector<uint8_t> mesh_as_glb(const HeadMesh& mesh, const std::vector<uint8_t>& texture) {
  GlbWriter glb;
  const std::vector<float> positions = positions_in_file(mesh);
  json attributes;
  const size_t position = glb.add_accessor(positions, 3, kFloat, kVertices);
  attributes["POSITION"] = position;
  std::array<float, 3> low{}, high{};
  for (size_t i = 0; i < positions.size(); ++i) {
    const size_t axis = i % 3;
    low[axis] = i < 3 ? positions[i] : std::min(low[axis], positions[i]);
    high[axis] = i < 3 ? positions[i] : std::max(high[axis], positions[i]);
  }
  glb.file()["accessors"][position]["min"] = low;
  glb.file()["accessors"][position]["max"] = high;
  if (!mesh.normals.empty()) {
    attributes["NORMAL"] = glb.add_accessor(normals_in_file(mesh), 3, kFloat, kVertices);
  }
  json material = {
      {"name", "head"},
      {"pbrMetallicRoughness",
       {{"baseColorFactor", json::array({1, 1, 1, 1})}, {"metallicFactor", 0}, {"roughnessFactor", 0.75}}}};
  if (!texture.empty()) {
    attributes["TEXCOORD_0"] = glb.add_accessor(mesh.texture_coordinates, 2, kFloat, kVertices);
    material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  } else if (!mesh.colours.empty()) {
    attributes["COLOR_0"] = glb.add_accessor(linear_colours(mesh.colours), 4, kUnsignedByte, kVertices);
  }
  const size_t indices = glb.add_accessor(mesh.triangles, 1, kUnsignedInt, kIndices);
  json& file = glb.file();
  if (!texture.empty()) {
    const size_t view = glb.add_view(texture.data(), texture.size(), kNoTarget);
    json image = {{"bufferView", view}, {"mimeType", is_png(texture) ? "image/png" : "image/jpeg"}};
    file["images"] = array_of(std::move(image));
    file["samplers"] = array_of({{"magFilter", 9729}, {"minFilter", 9987}});  // linear, with mip maps
    file["textures"] = array_of({{"sampler", 0}, {"source", 0}});
  }
  file["asset"] = {{"version", "2.0"}, {"generator", "Maquette"}};
  file["materials"] = array_of(std::move(material));
  json primitive = {{"attributes", std::move(attributes)}, {"indices", indices}, {"material", 0}};
  file["meshes"] = array_of({{"name", "head"}, {"primitives", array_of(std::move(primitive))}});
  file["nodes"] = array_of({{"name", "head"}, {"mesh", 0}});
  file["scenes"] = array_of({{"nodes", array_of(0)}});
  file["scene"] = 0;
  return glb.finish();
}

}  // namespace maq::head
