#include "core/files/glb_writer.h"

#include <algorithm>
#include <locale>
#include <sstream>

namespace maq {
namespace {

constexpr uint32_t kGltf = 0x46546C67, kVersion = 2, kJson = 0x4E4F534A, kBinary = 0x004E4942;

void append_word(std::vector<uint8_t>& to, uint32_t word) {
  const auto* const bytes = reinterpret_cast<const uint8_t*>(&word);  // every system of the SDK is little endian
  to.insert(to.end(), bytes, bytes + sizeof word);
}

void append_item(std::string& list, const std::string& item) { list += (list.empty() ? "" : ",") + item; }

const char* type_of(size_t each) {
  static constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  return each == 16 ? "MAT4" : kTypes[each];
}

}  // namespace

size_t GlbWriter::add_described(size_t view, size_t count, size_t each, GlbComponent type, const std::string& more,
                                bool whole) {
  const bool is_normalized = type == GlbComponent::kUnsignedByte && !whole;
  append_item(accessors_,
              concatenate("{\"bufferView\":", view, ",\"componentType\":", int(type), ",\"count\":", count,
                          ",\"type\":\"", type_of(each), '"', is_normalized ? ",\"normalized\":true" : "", more, '}'));
  return accessor_count_++;
}

size_t GlbWriter::add_sparse(size_t count, const std::vector<uint32_t>& vertices, const std::vector<float>& vectors,
                             const std::string& more) {
  std::string text = concatenate("{\"componentType\":5126,\"count\":", count, ",\"type\":\"VEC3\"", more);
  if (!vertices.empty()) {
    const size_t indices = add_view(vertices.data(), vertices.size() * sizeof(uint32_t), GlbTarget::kNone);
    const size_t values = add_view(vectors.data(), vectors.size() * sizeof(float), GlbTarget::kNone);
    text += concatenate(",\"sparse\":{\"count\":", vertices.size(), ",\"indices\":{\"bufferView\":", indices,
                        ",\"componentType\":5125},\"values\":{\"bufferView\":", values, "}}");
  }
  append_item(accessors_, text + '}');
  return accessor_count_++;
}

size_t GlbWriter::add_view(const void* data, size_t bytes, GlbTarget target) {
  std::string view = concatenate("{\"buffer\":0,\"byteOffset\":", bytes_.size(), ",\"byteLength\":", bytes);
  if (target != GlbTarget::kNone) view += concatenate(",\"target\":", int(target));
  append_item(views_, view + '}');
  bytes_.insert(bytes_.end(), static_cast<const uint8_t*>(data), static_cast<const uint8_t*>(data) + bytes);
  bytes_.resize((bytes_.size() + 3) / 4 * 4);
  return view_count_++;
}

std::vector<uint8_t> GlbWriter::finish(const std::string& rest) {
  std::string text =
      concatenate("{\"asset\":{\"version\":\"2.0\",\"generator\":\"Maquette\"},\"accessors\":[", accessors_,
                  "],\"bufferViews\":[", views_, "],\"buffers\":[{\"byteLength\":", bytes_.size(), "}]", rest, '}');
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::vector<uint8_t> made;
  made.reserve(28 + text.size() + bytes_.size());
  append_word(made, kGltf);
  append_word(made, kVersion);
  append_word(made, uint32_t(28 + text.size() + bytes_.size()));
  append_word(made, uint32_t(text.size()));
  append_word(made, kJson);
  made.insert(made.end(), text.begin(), text.end());
  append_word(made, uint32_t(bytes_.size()));
  append_word(made, kBinary);
  made.insert(made.end(), bytes_.begin(), bytes_.end());
  return made;
}

std::string glb_numbers(const float* values, size_t count) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(17);
  for (size_t i = 0; i < count; ++i) text << (i == 0 ? '[' : ',') << double(values[i]);
  text << ']';
  return text.str();
}

std::string glb_limits(const std::vector<float>& values, size_t each, bool with_zero) {
  std::vector<float> low(each), high(each);
  for (size_t i = 0; i < values.size(); ++i) {
    const size_t axis = i % each;
    const bool is_first = i < each && !with_zero;
    low[axis] = is_first ? values[i] : std::min(low[axis], values[i]);
    high[axis] = is_first ? values[i] : std::max(high[axis], values[i]);
  }
  return ",\"min\":" + glb_numbers(low.data(), each) + ",\"max\":" + glb_numbers(high.data(), each);
}

}  // namespace maq
