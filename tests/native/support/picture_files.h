// Images of an app, and how a file of one is read again through the C API.
#pragma once

#include <filesystem>
#include <maquette/maquette.hpp>
#include <vector>

// RGB; an image whose pixels differ from their neighbours, the same at each call.
inline std::vector<uint8_t> speckled(int width, int height, uint32_t seed = 1) {
  std::vector<uint8_t> pixels(size_t(width) * size_t(height) * 3);
  for (uint8_t& value : pixels) {
    seed = seed * 1664525 + 1013904223;
    value = uint8_t(seed >> 24);
  }
  return pixels;
}

inline maq_frame_desc describe(maq_pixel_format format, const std::vector<uint8_t>& pixels, int width, int height,
                               size_t stride_bytes = 0) {
  maq_frame_desc desc;
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = format;
  desc.width_px = width;
  desc.height_px = height;
  desc.planes[0] = pixels.data();
  desc.stride_bytes[0] = stride_bytes;
  return desc;
}

inline std::vector<uint8_t> rgb_of(const maquette::Frame& frame) {
  const maq_frame_desc desc = frame.desc();
  std::vector<uint8_t> pixels(size_t(desc.width_px) * size_t(desc.height_px) * 3);
  frame.copy_pixels(MAQ_PIXEL_RGB8, pixels.data(), 0, pixels.size());
  return pixels;
}

inline std::vector<uint8_t> read_rgb(const maquette::Context& context, const std::string& path) {
  return rgb_of(*maquette::Source(context, "image:" + path).next());
}

inline size_t files_in(const std::filesystem::path& folder) {
  return size_t(std::distance(std::filesystem::directory_iterator(folder), {}));
}

template <class Body>
maq_status status_of(Body&& body, std::string* text = nullptr) {
  try {
    body();
    return MAQ_OK;
  } catch (const maquette::Error& error) {
    if (text != nullptr) *text = error.what();
    return error.status();
  }
}
