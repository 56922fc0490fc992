#include <algorithm>
#include <array>
#include <cmath>

#include "scene/point_cloud.h"
#include "scene/splats/files/gzip_file.h"
#include "scene/splats/files/splat_files.h"
#include "scene/splats/files/spz_format.h"

namespace maq {
namespace {

constexpr uint8_t kMaxFractionBits = 24;
constexpr int kMaxSpzDegree = 4;

SpzHead read_spz_head(GzipFile& file) {
  SpzHead head;
  file.read(&head, sizeof head);
  if (head.magic != SpzHead::kMagic) file.file().fail(" is not an SPZ file: its first bytes are not \"NGSP\".");
  if (head.version < 2 || head.version > 3) {
    throw Error(MAQ_ERROR_UNSUPPORTED, file.file().path(), " is an SPZ file of version ", head.version,
                "; versions 2 and 3 are supported. Write it again in one of them.");
  }
  if (head.count == 0) file.file().fail(" has no splats, so there is nothing to show.");
  if (head.count > kMaxPoints) {
    throw Error(MAQ_ERROR_UNSUPPORTED, file.file().path(), " has ", head.count, " splats, over the limit of ",
                kMaxPoints, "; make it smaller.");
  }
  if (head.sh_degree > kMaxSpzDegree || head.fraction_bits > kMaxFractionBits) {
    file.file().fail(" is damaged: its harmonics have degree ", int(head.sh_degree), ", its positions ",
                     int(head.fraction_bits), " bits behind the point; copy it again.");
  }
  return head;
}

size_t rotation_bytes(const SpzHead& head) { return head.version == 2 ? 3 : 4; }

// Version 2: x, y and z of a quaternion; w is positive.
std::array<float, 4> first_three(const uint8_t* bytes) {
  std::array<float, 4> q{};
  float rest = 1;
  for (size_t i = 0; i < 3; ++i) {
    q[i + 1] = float(bytes[i]) / 127.5f - 1;
    rest -= q[i + 1] * q[i + 1];
  }
  q[0] = std::sqrt(std::max(0.0f, rest));
  return q;
}

// Version 3: the number of the largest part, which is positive, of x, y, z, w; then sign and size of the other three.
std::array<float, 4> smallest_three(const uint8_t* bytes) {
  uint32_t packed = uint32_t(bytes[0]) | uint32_t(bytes[1]) << 8 | uint32_t(bytes[2]) << 16 | uint32_t(bytes[3]) << 24;
  const size_t largest = packed >> 30;
  std::array<float, 4> q{};
  float rest = 1;
  for (size_t i = 4; i-- > 0;) {
    if (i == largest) continue;
    const float size = kSpzRotationRange * float(packed & kSpzMaxRotation) / float(kSpzMaxRotation);
    const float value = (packed >> 9 & 1) != 0 ? -size : size;
    packed >>= 10;
    q[(i + 1) % 4] = value;
    rest -= value * value;
  }
  q[(largest + 1) % 4] = std::sqrt(std::max(0.0f, rest));
  return q;
}

double spz_coordinate(const uint8_t* bytes, double step) {
  const uint32_t low = uint32_t(bytes[0]) | uint32_t(bytes[1]) << 8 | uint32_t(bytes[2]) << 16;
  return double(int32_t(low << 8) >> 8) * step;
}

}  // namespace

Splats read_spz(const std::string& path) {
  GzipFile file(path);
  const SpzHead head = read_spz_head(file);
  const size_t count = head.count, stored_terms = size_t(sh_terms(head.sh_degree));
  const size_t each = 9 + 1 + 3 + 3 + rotation_bytes(head) + 3 * stored_terms;
  if (uint64_t(count) * each > file.max_bytes()) {
    file.file().fail(" claims ", count,
                     " splats, more than its size can hold: it is truncated or damaged; copy it again.");
  }
  const auto read = [&](size_t bytes_each) {
    std::vector<uint8_t> bytes(bytes_each * count);
    file.read(bytes.data(), bytes.size());
    return bytes;
  };
  const std::vector<uint8_t> positions = read(9), opacities = read(1), colours = read(3), scales = read(3),
                             rotations = read(rotation_bytes(head)), harmonics = read(3 * stored_terms);
  Splats splats;
  splats.sh_degree = std::min(int(head.sh_degree), kMaxShDegree);
  splats.is_antialiased = (head.flags & SpzHead::kAntialiased) != 0;
  splats.stored_bits = 8;
  splats.reserve(count);
  const double step = std::ldexp(1.0, -int(head.fraction_bits));
  const size_t terms = size_t(sh_terms(splats.sh_degree));
  for (size_t i = 0; i < count; ++i) {
    Splat splat;
    for (size_t axis = 0; axis < 3; ++axis) {
      splat.position[axis] = spz_coordinate(&positions[9 * i + 3 * axis], step);
      splat.scale[axis] = std::exp(float(scales[3 * i + axis]) / kSpzScaleSteps - kSpzScaleOffset);
      splat.colour[axis] = 0.5f + (float(colours[3 * i + axis]) / 255 - 0.5f) * (kShConstant / kSpzColourScale);
    }
    splat.opacity = float(opacities[i]) / 255;
    splat.rotation = head.version == 2 ? first_three(&rotations[3 * i]) : smallest_three(&rotations[4 * i]);
    if (!splats.add(splat)) continue;
    for (size_t k = 0; k < 3 * terms; ++k) {
      splats.sh.push_back(sh_steps((double(harmonics[3 * stored_terms * i + k]) - 128) / double(kSpzHarmonicSteps)));
    }
  }
  if (splats.count() == 0) file.file().fail(" has no splat with a rotation, so there is nothing to show.");
  return splats;
}

bool is_splat_file(const std::string& path) {
  FileReader file(path);
  std::array<char, 4> start{};
  file.read(start.data(), size_t(std::min<uint64_t>(start.size(), file.remaining())));
  const std::string_view text(start.data(), start.size());
  return text.substr(0, 3) == "ply" || text.substr(0, 2) == "\x1f\x8b" || text == "NGSP";
}

Splats read_splat_file(const std::string& path) {
  FileReader file(path);
  std::array<char, 4> start{};
  file.read(start.data(), size_t(std::min<uint64_t>(start.size(), file.remaining())));
  const std::string_view text(start.data(), start.size());
  if (text.substr(0, 3) == "ply") return read_splat_ply(path);
  if (text.substr(0, 2) == "\x1f\x8b") return read_spz(path);
  if (text == "NGSP") {
    throw Error(
        MAQ_ERROR_UNSUPPORTED, path,
        " is an SPZ file of version 4 or later; versions 2 and 3 are supported. Convert it, for example to a PLY "
        "file by: splat-transform IN.spz OUT.ply.");
  }
  file.fail(" is neither a PLY nor an SPZ file of splats.");
}

}  // namespace maq
