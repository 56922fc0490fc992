// glTF 2.0 in one file (Khronos, glTF 2.0 specification, 4.4): a header, a chunk of JSON, a chunk of bytes. The JSON is
// written as text: its names are the caller's, and all else in it are numbers. (A library for it costs more bytes than
// this.)
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/error.h"

namespace maq {

enum class GlbComponent { kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126 };
enum class GlbTarget { kNone = 0, kVertices = 34962, kIndices = 34963 };

class GlbWriter {
 public:
  // Adds an accessor of elements of `each` numbers (1 to 4, or 16 for matrices) and returns its number. Bytes are
  // normalised unless they are `whole`. `more` ends its text: ",\"min\":…".
  template <class T>
  size_t add_accessor(const std::vector<T>& values, size_t each, GlbComponent type, GlbTarget target,
                      const std::string& more = "", bool whole = false) {
    const size_t view = add_view(values.data(), values.size() * sizeof(T), target);
    return add_described(view, values.size() / each, each, type, more, whole);
  }

  // Adds an accessor of vectors that are 0 except at `vertices` (glTF 2.0, 3.6.2.3).
  size_t add_sparse(size_t count, const std::vector<uint32_t>& vertices, const std::vector<float>& vectors,
                    const std::string& more);

  // Adds a part of the chunk of bytes and returns its number.
  size_t add_view(const void* data, size_t bytes, GlbTarget target);

  // Returns the file. `rest`: the other members of the JSON, ",\"meshes\":…".
  std::vector<uint8_t> finish(const std::string& rest);

 private:
  size_t add_described(size_t view, size_t count, size_t each, GlbComponent type, const std::string& more, bool whole);

  std::string accessors_, views_;
  size_t accessor_count_ = 0, view_count_ = 0;
  std::vector<uint8_t> bytes_;
};

// A list of numbers, [1,2,3], that equal the floats exactly.
std::string glb_numbers(const float* values, size_t count);

// ",\"min\":…,\"max\":…" of elements of `each` floats. `with_zero`: some that are 0 are not among them.
std::string glb_limits(const std::vector<float>& values, size_t each, bool with_zero = false);

}  // namespace maq
