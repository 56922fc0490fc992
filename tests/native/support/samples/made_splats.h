// Splats for tests, and their bytes as files of other programs have them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

struct MadeSplat {
  std::array<double, 3> position;
  std::array<double, 3> scale;
  std::array<double, 4> rotation;  // w, x, y, z; of length 1
  double opacity;
  std::array<double, 3> coefficient;  // of degree 0
  std::array<double, 45> sh;          // [term][channel]
};

struct MadeSplats {
  int degree = 0;
  std::vector<MadeSplat> splats;

  int terms() const { return (degree + 1) * (degree + 1) - 1; }

  // `form`: ascii, binary_little_endian or binary_big_endian. `left_out`: a property that the file does not have.
  std::string ply(const std::string& form = "binary_little_endian", const std::string& left_out = "") const {
    std::vector<std::string> names = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"};
    for (int i = 0; i < 3 * terms(); ++i) names.push_back("f_rest_" + std::to_string(i));
    for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
      names.emplace_back(name);
    }
    std::string text =
        "ply\nformat " + form + " 1.0\ncomment made for a test\nelement vertex " + std::to_string(splats.size()) + "\n";
    for (const std::string& name : names) {
      if (name != left_out) text += "property float " + name + "\n";
    }
    text += "end_header\n";
    for (const MadeSplat& splat : splats) {
      std::vector<double> row(splat.position.begin(), splat.position.end());
      row.resize(6);
      row.insert(row.end(), splat.coefficient.begin(), splat.coefficient.end());
      for (int channel = 0; channel < 3; ++channel) {
        for (int term = 0; term < terms(); ++term) row.push_back(splat.sh[size_t(3 * term + channel)]);
      }
      row.push_back(std::log(splat.opacity / (1 - splat.opacity)));
      for (const double scale : splat.scale) row.push_back(std::log(scale));
      row.insert(row.end(), splat.rotation.begin(), splat.rotation.end());
      for (size_t i = 0; i < row.size(); ++i) {
        if (names[i] != left_out) append(text, float(row[i]), form);
      }
      if (form == "ascii") text += "\n";
    }
    return text;
  }

  // An SPZ file before it is compressed.
  std::vector<uint8_t> spz(uint32_t version = 3, uint32_t claimed = 0, int stored_degree = -1) const {
    std::vector<uint8_t> bytes;
    const auto put = [&](double value) { bytes.push_back(uint8_t(std::clamp(std::lround(value), 0L, 255L))); };
    const uint32_t head[3] = {0x5053474e, version, claimed != 0 ? claimed : uint32_t(splats.size())};
    bytes.resize(16);
    std::memcpy(bytes.data(), head, sizeof head);
    bytes[12] = uint8_t(stored_degree >= 0 ? stored_degree : degree);
    bytes[13] = 12;
    for (const MadeSplat& splat : splats) {
      for (const double value : splat.position) {
        const auto fixed = uint32_t(int32_t(std::lround(value * 4096)));
        for (int shift = 0; shift < 24; shift += 8) bytes.push_back(uint8_t(fixed >> shift));
      }
    }
    for (const MadeSplat& splat : splats) put(splat.opacity * 255);
    for (const MadeSplat& splat : splats) {
      for (const double value : splat.coefficient) put(255 * (0.5 + 0.15 * value));
    }
    for (const MadeSplat& splat : splats) {
      for (const double value : splat.scale) put(16 * (std::log(value) + 10));
    }
    for (const MadeSplat& splat : splats) put_rotation(splat.rotation, version, bytes);
    for (const MadeSplat& splat : splats) {
      for (int k = 0; k < 3 * terms(); ++k) put(128 + 128 * splat.sh[size_t(k)]);
    }
    return bytes;
  }

 private:
  static void append(std::string& text, float value, const std::string& form) {
    if (form == "ascii") {
      char number[32];
      std::snprintf(number, sizeof number, "%.9g ", double(value));
      text += number;
      return;
    }
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    if (form == "binary_big_endian") std::reverse(bytes, bytes + sizeof value);
    text.append(bytes, sizeof value);
  }

  static void put_rotation(const std::array<double, 4>& wxyz, uint32_t version, std::vector<uint8_t>& bytes) {
    std::array<double, 4> q = {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
    if (version == 2) {
      const double sign = q[3] < 0 ? -1 : 1;
      for (size_t i = 0; i < 3; ++i) bytes.push_back(uint8_t(std::lround(127.5 + 127.5 * sign * q[i])));
      return;
    }
    size_t largest = 0;
    for (size_t i = 1; i < 4; ++i) {
      if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
    }
    auto packed = uint32_t(largest);
    for (size_t i = 0; i < 4; ++i) {
      if (i == largest) continue;
      const bool is_negative = (q[i] < 0) != (q[largest] < 0);
      packed = packed << 10 | (is_negative ? 512u : 0u) | uint32_t(std::lround(511 * std::abs(q[i]) * std::sqrt(2.0)));
    }
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(uint8_t(packed >> shift));
  }
};

// Random splats of all shapes around `middle`, within a ball of `size`.
inline MadeSplats made_splats(size_t count, int degree, unsigned seed = 1, double size = 1,
                              const std::array<double, 3>& middle = {0, 0, 0}) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  MadeSplats made;
  made.degree = degree;
  for (size_t i = 0; i < count; ++i) {
    MadeSplat splat{};
    double length = 0;
    for (size_t k = 0; k < 4; ++k) {
      splat.rotation[k] = normal(random);
      length += splat.rotation[k] * splat.rotation[k];
    }
    for (double& part : splat.rotation) part /= std::sqrt(length);
    for (size_t k = 0; k < 3; ++k) {
      splat.position[k] = middle[k] + size * (2 * unit(random) - 1);
      splat.scale[k] = size * std::exp(-3.5 + normal(random));
      splat.coefficient[k] = normal(random);
    }
    splat.opacity = 0.02 + 0.96 * unit(random);
    for (int k = 0; k < 3 * made.terms(); ++k) splat.sh[size_t(k)] = std::clamp(0.2 * normal(random), -0.9, 0.9);
    made.splats.push_back(splat);
  }
  return made;
}
