#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/files/atomic_file.h"
#include "core/files/glb_writer.h"
#include "core/math/rotation.h"
#include "scene/splats/files/gzip_file.h"
#include "scene/splats/files/splat_files.h"
#include "scene/splats/files/spz_format.h"

namespace maq {
namespace {

// A logit and a logarithm hold nothing smaller.
constexpr float kMinFileOpacity = 1e-6f, kMinFileScale = 1e-12f;

float logit(float opacity) {
  const float within = std::clamp(opacity, kMinFileOpacity, 1 - kMinFileOpacity);
  return std::log(within / (1 - within));
}

float log_scale(float scale) { return std::log(std::max(scale, kMinFileScale)); }

float coefficient_of(float colour) { return (colour - 0.5f) / kShConstant; }

double world_position(const Splats& splats, size_t number) {
  return splats.origin[number % 3] + double(splats.position[number]);
}

uint8_t rounded_byte(float value) { return uint8_t(std::lround(std::clamp(value, 0.0f, 255.0f))); }

std::vector<uint8_t> splat_ply_of(const Splats& splats) {
  const size_t terms = size_t(sh_terms(splats.sh_degree));
  std::string head = "ply\nformat binary_little_endian 1.0\ncomment splats by Maquette\n";
  if (splats.is_antialiased) head += "comment SplatRenderMode: mip\n";
  head += "element vertex " + std::to_string(splats.count()) + "\n";
  std::vector<std::string> names = {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"};
  for (size_t k = 0; k < 3 * terms; ++k) names.push_back("f_rest_" + std::to_string(k));
  for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    names.emplace_back(name);
  }
  for (const std::string& name : names) head += "property float " + name + "\n";
  head += "end_header\n";
  std::vector<uint8_t> bytes(head.size() + splats.count() * names.size() * sizeof(float));
  std::memcpy(bytes.data(), head.data(), head.size());
  std::vector<float> row(names.size());
  for (size_t i = 0; i < splats.count(); ++i) {
    float* to = row.data();
    for (size_t k = 0; k < 3; ++k) *to++ = float(world_position(splats, 3 * i + k));
    for (size_t k = 0; k < 3; ++k) *to++ = coefficient_of(splats.colour[3 * i + k]);
    for (size_t channel = 0; channel < 3; ++channel) {
      for (size_t term = 0; term < terms; ++term) *to++ = kShStep * float(splats.sh[3 * (terms * i + term) + channel]);
    }
    *to++ = logit(splats.opacity[i]);
    for (size_t k = 0; k < 3; ++k) *to++ = log_scale(splats.scale[3 * i + k]);
    for (size_t k = 0; k < 4; ++k) *to++ = splats.rotation[4 * i + k];
    std::memcpy(bytes.data() + head.size() + i * row.size() * sizeof(float), row.data(), row.size() * sizeof(float));
  }
  return bytes;
}

// As many bits behind the point as the largest coordinate leaves.
uint8_t fraction_bits_of(const Splats& splats) {
  double largest = 0;
  for (size_t i = 0; i < splats.position.size(); ++i) largest = std::max(largest, std::abs(world_position(splats, i)));
  constexpr double kPositionSteps = (1 << 23) - 1;
  if (largest > kPositionSteps) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "A splat is ", largest,
                " units away from the origin, too far for an SPZ file, which has 24 bits; write a .ply file.");
  }
  uint8_t bits = 0;
  while (bits < 16 && std::ldexp(largest, bits + 1) <= kPositionSteps) ++bits;
  return bits;
}

void append_rotation(const float* wxyz, std::vector<uint8_t>& bytes) {
  const float q[4] = {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
  const auto largest =
      size_t(std::max_element(q, q + 4, [](float a, float b) { return std::abs(a) < std::abs(b); }) - q);
  auto packed = uint32_t(largest);
  for (size_t i = 0; i < 4; ++i) {
    if (i == largest) continue;
    const float size = std::abs(q[i]) / kSpzRotationRange;
    const auto steps = uint32_t(std::lround(std::min(size, 1.0f) * float(kSpzMaxRotation)));
    packed = packed << 10 | ((q[i] < 0) != (q[largest] < 0) ? kSpzMaxRotation + 1 : 0) | steps;
  }
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(uint8_t(packed >> shift));
}

// The quaternion x, y, z, w that turns `up` to glTF's, which is y.
std::array<float, 4> turn_to_y(const std::array<double, 3>& up) {
  const Vec3 from = normalized({up[0], up[1], up[2]});
  if (from.y < -0.999999) return {1, 0, 0, 0};
  const Vec3 axis = cross(from, {0, 1, 0});
  const double real = 1 + from.y, size = std::sqrt(real * real + dot(axis, axis));
  return {float(axis.x / size), float(axis.y / size), float(axis.z / size), float(real / size)};
}

}  // namespace

std::vector<uint8_t> spz_of(const Splats& splats) {
  SpzHead head;
  head.count = uint32_t(splats.count());
  head.sh_degree = uint8_t(splats.sh_degree);
  head.fraction_bits = fraction_bits_of(splats);
  head.flags = splats.is_antialiased ? SpzHead::kAntialiased : 0;
  std::vector<uint8_t> bytes(sizeof head);
  std::memcpy(bytes.data(), &head, sizeof head);
  bytes.reserve(sizeof head + splats.count() * 20 + splats.sh.size());
  for (size_t i = 0; i < splats.position.size(); ++i) {
    const auto steps = uint32_t(int32_t(std::lround(std::ldexp(world_position(splats, i), head.fraction_bits))));
    for (int shift = 0; shift < 24; shift += 8) bytes.push_back(uint8_t(steps >> shift));
  }
  for (const float opacity : splats.opacity) bytes.push_back(rounded_byte(255 * opacity));
  for (const float colour : splats.colour) {
    bytes.push_back(rounded_byte(255 * (0.5f + kSpzColourScale * coefficient_of(colour))));
  }
  for (const float scale : splats.scale) {
    bytes.push_back(rounded_byte(kSpzScaleSteps * (log_scale(scale) + kSpzScaleOffset)));
  }
  for (size_t i = 0; i < splats.count(); ++i) append_rotation(&splats.rotation[4 * i], bytes);
  for (const int16_t sh : splats.sh) bytes.push_back(rounded_byte(kSpzHarmonicSteps * (1 + kShStep * float(sh))));
  return gzip_of(bytes);
}

std::vector<uint8_t> glb_of(const Splats& splats) {
  const size_t count = splats.count(), terms = size_t(sh_terms(splats.sh_degree));
  std::vector<uint8_t> rgba(4 * count);
  std::vector<float> rotation(4 * count), vectors(3 * count);
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      rgba[4 * i + k] = rounded_byte(255 * splats.colour[3 * i + k]);
      rotation[4 * i + k] = splats.rotation[4 * i + k + 1];
      vectors[3 * i + k] = coefficient_of(splats.colour[3 * i + k]);
    }
    rgba[4 * i + 3] = rounded_byte(255 * splats.opacity[i]);
    rotation[4 * i + 3] = splats.rotation[4 * i];
  }
  GlbWriter writer;
  std::string attributes;
  const auto add = [&](const std::string& name, size_t accessor) {
    attributes += (attributes.empty() ? "\"" : ",\"") + name + "\":" + std::to_string(accessor);
  };
  const std::string own = "KHR_gaussian_splatting:";
  const GlbTarget target = GlbTarget::kVertices;
  add("POSITION",
      writer.add_accessor(splats.position, 3, GlbComponent::kFloat, target, glb_limits(splats.position, 3)));
  add("COLOR_0", writer.add_accessor(rgba, 4, GlbComponent::kUnsignedByte, target));
  add(own + "ROTATION", writer.add_accessor(rotation, 4, GlbComponent::kFloat, target));
  add(own + "SCALE", writer.add_accessor(splats.scale, 3, GlbComponent::kFloat, target));
  add(own + "OPACITY", writer.add_accessor(splats.opacity, 1, GlbComponent::kFloat, target));
  add(own + "SH_DEGREE_0_COEF_0", writer.add_accessor(vectors, 3, GlbComponent::kFloat, target));
  for (int degree = 1; degree <= splats.sh_degree; ++degree) {
    for (int order = 0; order <= 2 * degree; ++order) {
      const auto term = size_t(sh_terms(degree - 1) + order);
      for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < 3; ++k) vectors[3 * i + k] = kShStep * float(splats.sh[3 * (terms * i + term) + k]);
      }
      add(own + "SH_DEGREE_" + std::to_string(degree) + "_COEF_" + std::to_string(order),
          writer.add_accessor(vectors, 3, GlbComponent::kFloat, target));
    }
  }
  const std::array<float, 4> turn = turn_to_y(splats.up);
  const float origin[3] = {float(splats.origin[0]), float(splats.origin[1]), float(splats.origin[2])};
  return writer.finish(
      ",\"extensionsUsed\":[\"KHR_gaussian_splatting\"],\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":["
      "{\"rotation\":" +
      glb_numbers(turn.data(), 4) + ",\"children\":[1]},{\"translation\":" + glb_numbers(origin, 3) +
      ",\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"mode\":0,\"attributes\":{" + attributes +
      "},\"extensions\":{\"KHR_gaussian_splatting\":{\"kernel\":\"ellipse\",\"colorSpace\":\"srgb_rec709_display\","
      "\"sortingMethod\":\"cameraDistance\",\"projection\":\"perspective\"}}}]}]");
}

bool is_name_of_splats(const std::string& path) {
  const std::string extension = lower_case_extension(path);
  return extension == ".ply" || extension == ".spz" || extension == ".glb";
}

void write_splat_file(const Splats& splats, const std::string& path) {
  const std::string extension = lower_case_extension(path);
  const std::vector<uint8_t> bytes = extension == ".spz"   ? spz_of(splats)
                                     : extension == ".glb" ? glb_of(splats)
                                                           : splat_ply_of(splats);
  AtomicFile file(path);
  file.append(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace maq
