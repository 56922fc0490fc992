// glTF 2.0 in one file (Khronos, glTF 2.0 specification, 4.4): a header, a chunk of JSON, a chunk of bytes.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <locale>
#include <sstream>

#include "core/error.h"
#include "head/mesh/file_axes.h"
#include "head/mesh/mesh_files.h"

namespace maq::head {
namespace {

enum class Component { kUnsignedByte = 5121, kUnsignedInt = 5125, kFloat = 5126 };
enum BufferTarget { kNoTarget = 0, kVertices = 34962, kIndices = 34963 };

void append_word(std::vector<uint8_t>& to, uint32_t word) {
  const auto* const bytes = reinterpret_cast<const uint8_t*>(&word);  // every system of the SDK is little endian
  to.insert(to.end(), bytes, bytes + sizeof word);
}

// Numbers in the notation of C; they equal the floats exactly.
std::string text_of(const std::array<float, 3>& values) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(17);
  text << '[' << double(values[0]) << ',' << double(values[1]) << ',' << double(values[2]) << ']';
  return text.str();
}

// The JSON is written as text: its names are ours, and all else in it are numbers. (A library for it costs more bytes
// than the rest of this file.)
class GlbWriter {
 public:
  // The number of the accessor. `more` ends its text: ",\"min\":…".
  template <class T>
  size_t add_accessor(const std::vector<T>& values, size_t each, Component type, BufferTarget target,
                      const std::string& more = "") {
    static constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    add(accessors_,
        concatenate("{\"bufferView\":", add_view(values.data(), values.size() * sizeof(T), target),
                    ",\"componentType\":", int(type), ",\"count\":", values.size() / each, ",\"type\":\"", kTypes[each],
                    '"', type == Component::kUnsignedByte ? ",\"normalized\":true" : "", more, '}'));
    return accessor_count_++;
  }

  // Adds an accessor of vectors that are 0 except at `vertices` (glTF 2.0, 3.6.2.3).
  size_t add_sparse(size_t count, const std::vector<uint32_t>& vertices, const std::vector<float>& vectors,
                    const std::string& more) {
    std::string text = concatenate("{\"componentType\":5126,\"count\":", count, ",\"type\":\"VEC3\"", more);
    if (!vertices.empty()) {
      const size_t indices = add_view(vertices.data(), vertices.size() * sizeof(uint32_t), kNoTarget);
      const size_t values = add_view(vectors.data(), vectors.size() * sizeof(float), kNoTarget);
      text += concatenate(",\"sparse\":{\"count\":", vertices.size(), ",\"indices\":{\"bufferView\":", indices,
                          ",\"componentType\":5125},\"values\":{\"bufferView\":", values, "}}");
    }
    add(accessors_, text + '}');
    return accessor_count_++;
  }

  size_t add_view(const void* data, size_t bytes, BufferTarget target) {
    std::string view = concatenate("{\"buffer\":0,\"byteOffset\":", bytes_.size(), ",\"byteLength\":", bytes);
    if (target != kNoTarget) view += concatenate(",\"target\":", int(target));
    add(views_, view + '}');
    bytes_.insert(bytes_.end(), static_cast<const uint8_t*>(data), static_cast<const uint8_t*>(data) + bytes);
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    return view_count_++;
  }

  // `rest`: the other members of the file, ",\"meshes\":…".
  std::vector<uint8_t> finish(const std::string& rest) {
    std::string text =
        concatenate("{\"asset\":{\"version\":\"2.0\",\"generator\":\"Maquette\"},\"accessors\":[", accessors_,
                    "],\"bufferViews\":[", views_, "],\"buffers\":[{\"byteLength\":", bytes_.size(), "}]", rest, '}');
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
  static void add(std::string& list, const std::string& item) { list += (list.empty() ? "" : ",") + item; }

  std::string accessors_, views_;
  size_t accessor_count_ = 0, view_count_ = 0;
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

// ",\"min\":…,\"max\":…" of vectors; `with_zero`: some that are 0 are not among them.
std::string limits_of(const std::vector<float>& vectors, bool with_zero) {
  std::array<float, 3> low{}, high{};
  for (size_t i = 0; i < vectors.size(); ++i) {
    const size_t axis = i % 3;
    const bool is_first = i < 3 && !with_zero;
    low[axis] = is_first ? vectors[i] : std::min(low[axis], vectors[i]);
    high[axis] = is_first ? vectors[i] : std::max(high[axis], vectors[i]);
  }
  return ",\"min\":" + text_of(low) + ",\"max\":" + text_of(high);
}

}  // namespace

std::vector<uint8_t> mesh_as_glb(const HeadMesh& mesh, const std::vector<uint8_t>& texture) {
  GlbWriter glb;
  const std::vector<float> positions = positions_in_file(mesh);
  const std::string limits = limits_of(positions, false);
  std::string attributes =
      concatenate("\"POSITION\":", glb.add_accessor(positions, 3, Component::kFloat, kVertices, limits));
  if (!mesh.normals.empty()) {
    attributes += concatenate(",\"NORMAL\":", glb.add_accessor(normals_in_file(mesh), 3, Component::kFloat, kVertices));
  }
  std::string of_material, of_file;
  if (!mesh.texture_coordinates.empty()) {
    attributes +=
        concatenate(",\"TEXCOORD_0\":", glb.add_accessor(mesh.texture_coordinates, 2, Component::kFloat, kVertices));
  }
  if (!texture.empty()) {
    of_material = ",\"baseColorTexture\":{\"index\":0}";
  } else if (!mesh.colours.empty()) {
    attributes += concatenate(",\"COLOR_0\":",
                              glb.add_accessor(linear_colours(mesh.colours), 4, Component::kUnsignedByte, kVertices));
  }
  std::string targets, names;
  for (const MorphTarget& target : mesh.morph_targets) {
    const std::vector<float> moves = to_file_axes(target.deltas, [](const float*) { return 0.1; });
    const bool is_sparse = target.vertices.size() < mesh.vertex_count();
    const size_t accessor = glb.add_sparse(mesh.vertex_count(), target.vertices, moves, limits_of(moves, is_sparse));
    targets += concatenate(targets.empty() ? "" : ",", "{\"POSITION\":", accessor, '}');
    names += concatenate(names.empty() ? "" : ",", '"', target.name, '"');
  }
  std::string of_primitive, of_mesh;
  if (!targets.empty()) {
    of_primitive = ",\"targets\":[" + targets + ']';
    of_mesh = ",\"extras\":{\"targetNames\":[" + names + "]}";
  }
  const size_t indices = glb.add_accessor(mesh.triangles, 1, Component::kUnsignedInt, kIndices);
  if (!texture.empty()) {
    const size_t view = glb.add_view(texture.data(), texture.size(), kNoTarget);
    of_file =
        concatenate(",\"images\":[{\"bufferView\":", view, ",\"mimeType\":\"image/", is_png(texture) ? "png" : "jpeg",
                    "\"}],\"samplers\":[{\"magFilter\":9729,\"minFilter\":9987}]"  // linear, with mip maps
                    ",\"textures\":[{\"sampler\":0,\"source\":0}]");
  }
  return glb.finish(
      concatenate(of_file,
                  ",\"materials\":[{\"name\":\"head\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,1],"
                  "\"metallicFactor\":0,\"roughnessFactor\":0.75",
                  of_material, "}}],\"meshes\":[{\"name\":\"head\",\"primitives\":[{\"attributes\":{", attributes,
                  "},\"indices\":", indices, ",\"material\":0", of_primitive, "}]", of_mesh,
                  "}],\"nodes\":[{\"name\":\"head\",\"mesh\":0}],\"scenes\":[{\"nodes\":[0]}],\"scene\":0"));
}

}  // namespace maq::head
