#include "head/texture/texture_bake.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/error.h"
#include "head/mesh/mesh_raster.h"
#include "head/texture/photo_light.h"
#include "head/texture/smooth_fill.h"
#include "head/texture/texels.h"
#include "head/texture/texture_layout.h"
#include "head/texture/unseen_parts.h"

namespace maq::head {
namespace {

// From the first cosine between normal and view on a photo counts, from the second wholly.
constexpr double kFirstCosine = 0.2, kWholeCosine = 0.65;
// From the first share of head on in the matte a photo counts, from the second wholly.
constexpr double kFirstMatte = 0.6, kWholeMatte = 0.95;
// A surface is hidden when another is before it by more: decimetres.
constexpr double kHiddenBehind_dm = 0.06;
constexpr int kMargin_px = 2;  // of a photo's square
// The front of the neck is this far from the texture's middle, in sides. There a photo often shows a collar or the
// shadow of the chin: from the first luma off the photos' mean on its pixels count less, from the second not at all.
constexpr double kNeckFraction = 0.43, kFirstCollar = 35, kWholeCollar = 70;
// The light is known for the mesh's colours that photos show. Colours darker than all but this fraction of these keep
// their hue: they are scaled as the darkest that is known.
constexpr double kDarkestFraction = 0.2;
// No part is darker in the photos' light than by this factor of its colour in the mean light of what they show: the
// light on the back is a guess.
constexpr double kMinLight = 0.85;
// The removal of light brightens photos by at most 1 / this.
constexpr double kMinPhotoLight = 0.25;

double luma(const float* rgb) { return 0.299 * double(rgb[0]) + 0.587 * double(rgb[1]) + 0.114 * double(rgb[2]); }

void draw_texel_rows(const HeadMesh& mesh, int side, int first_row, int end_row, Texels& texels,
                     std::vector<float>& outermost) {
  const auto draw = [&](size_t texel, const uint32_t* t, const double* shares) {
    const auto between = [&](const auto& values, size_t axis) {
      double sum = 0;
      for (size_t k = 0; k < 3; ++k) sum += shares[k] * double(values[3 * size_t(t[k]) + axis]);
      return float(sum);
    };
    float squared = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const float value = between(mesh.positions, axis);
      squared += value * value;
    }
    if (texels.is_surface[texel] != 0 && squared <= outermost[texel]) return;
    outermost[texel] = squared;
    texels.is_surface[texel] = 1;
    for (size_t axis = 0; axis < 3; ++axis) {
      texels.positions[3 * texel + axis] = between(mesh.positions, axis);
      texels.normals[3 * texel + axis] = between(mesh.normals, axis);
      texels.colours[3 * texel + axis] = between(mesh.colours, axis);
    }
  };
  for_each_texel(mesh.texture_coordinates, mesh.triangles, side, first_row, end_row, draw);
}

Texels draw_texels(const HeadMesh& mesh, int side, WorkerThreads& threads) {
  const size_t count = size_t(side) * size_t(side);
  Texels texels;
  for (auto* values : {&texels.positions, &texels.normals, &texels.colours}) values->resize(3 * count);
  texels.is_surface.resize(count), texels.is_cap.resize(count);
  std::vector<float> outermost(count);
  threads.run(size_t(side + kTexelRowsOfTask - 1) / kTexelRowsOfTask, [&](size_t task, int) {
    const int first = int(task) * kTexelRowsOfTask;
    draw_texel_rows(mesh, side, first, std::min(side, first + kTexelRowsOfTask), texels, outermost);
  });
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const float u = (float(column) + 0.5f) / float(side), v = (float(row) + 0.5f) / float(side);
      texels.is_cap[size_t(row) * size_t(side) + size_t(column)] = is_in_cap_disc(u, v) ? 1 : 0;
    }
  }
  return texels;
}

// Replaces the mesh's colours by the colours of a texture of any size.
void take_colours(const TextureImage& from, int side, Texels& texels) {
  const double scale = double(from.side_px) / double(side);
  for (size_t i = 0; i < texels.is_surface.size(); ++i) {
    if (texels.is_surface[i] == 0) continue;
    const size_t row = i / size_t(side), column = i % size_t(side);
    const double x = (double(column) + 0.5) * scale - 0.5, y = (double(row) + 0.5) * scale - 0.5;
    const auto bgr = between_pixels<uint8_t, 3>(from.bgr, from.side_px, from.side_px, x, y);
    for (size_t c = 0; c < 3; ++c) texels.colours[3 * i + c] = float(bgr[2 - c]);
  }
}

// Fraction of the 5 x 5 pixels around a position that show a surface at this depth or behind it. It is 0 at an occluder
// and just next to it, because a fitted edge is not exactly at the photo's edge.
double seen_fraction(const RenderedImage& depths, double x, double y, double depth, int spacing_px) {
  int seen = 0;
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) {
      const int column = std::clamp(int(std::lround(x)) + i * spacing_px, 0, depths.width_px - 1);
      const int row = std::clamp(int(std::lround(y)) + j * spacing_px, 0, depths.height_px - 1);
      const float nearest = depths.depth[size_t(row) * size_t(depths.width_px) + size_t(column)];
      seen += nearest == 0 || depth <= double(nearest) + kHiddenBehind_dm;
    }
  }
  return smooth_step(seen / 25.0, 0.8, 1);
}

// The differences of one photo. Its weight is a confidence, 0 to 1.
Differences differences_of(const TexturePhoto& photo, const HeadMesh& mesh, const Texels& texels, int side,
                           WorkerThreads& threads) {
  const HeadCamera& camera = photo.camera;
  RenderedImage depths;
  MeshRaster raster;
  raster.draw(mesh, camera, {}, threads, depths);
  const Vec3 eye = inverse(camera.head_to_camera).translation;
  const int spacing_px = std::max(1, camera.width_px / 192);
  Differences made;
  made.values.resize(texels.positions.size()), made.weights.resize(texels.is_surface.size());
  threads.run(size_t(side), [&](size_t row, int) {
    for (size_t texel = row * size_t(side); texel < (row + 1) * size_t(side); ++texel) {
      if (texels.is_surface[texel] == 0 || texels.is_cap[texel] != 0) continue;
      const float *p = &texels.positions[3 * texel], *n = &texels.normals[3 * texel];
      const Vec3 point{double(p[0]), double(p[1]), double(p[2])};
      const Vec3 normal = normalized({double(n[0]), double(n[1]), double(n[2])});
      const double facing = smooth_step(dot(normal, normalized(eye - point)), kFirstCosine, kWholeCosine);
      const Vec3 seen = camera.head_to_camera * point;
      if (facing <= 0 || !(seen.z > 0)) continue;
      const double x = camera.focal_px * seen.x / seen.z + camera.cx_px;
      const double y = camera.focal_px * seen.y / seen.z + camera.cy_px;
      if (!(x >= kMargin_px && y >= kMargin_px && x <= camera.width_px - 1 - kMargin_px &&
            y <= camera.height_px - 1 - kMargin_px)) {
        continue;
      }
      const double cell_x = (x + 0.5) / camera.width_px * photo.matte_side - 0.5;
      const double cell_y = (y + 0.5) / camera.height_px * photo.matte_side - 0.5;
      const double matte = between_pixels<float, 1>(photo.matte, photo.matte_side, photo.matte_side, cell_x, cell_y)[0];
      const double weight =
          facing * smooth_step(matte, kFirstMatte, kWholeMatte) * seen_fraction(depths, x, y, seen.z, spacing_px);
      if (weight <= 0) continue;
      const auto rgb = between_pixels<uint8_t, 3>(photo.rgb, camera.width_px, camera.height_px, x, y);
      for (size_t c = 0; c < 3; ++c) made.values[3 * texel + c] = float(rgb[c]) - texels.colours[3 * texel + c];
      made.weights[texel] = float(weight);
    }
  });
  return made;
}

// All photos together: the differences of each without its mean, and the mean over all.
Differences blend(const std::vector<TexturePhoto>& photos, const HeadMesh& mesh, const Texels& texels, int side,
                  WorkerThreads& threads) {
  Differences all;
  all.values.resize(texels.positions.size()), all.weights.resize(texels.is_surface.size());
  std::vector<float> shares(all.weights.size());
  double mean_of_all[3] = {}, weight_of_all = 0;
  for (const TexturePhoto& photo : photos) {
    const Differences one = differences_of(photo, mesh, texels, side, threads);
    double sums[3] = {}, weight = 0;
    for (size_t i = 0; i < one.weights.size(); ++i) {
      weight += double(one.weights[i]);
      for (size_t c = 0; c < 3; ++c) sums[c] += double(one.weights[i]) * double(one.values[3 * i + c]);
    }
    if (weight <= 0) continue;
    // Texels of a photo that shows the head larger count more.
    const double distance = length(photo.camera.head_to_camera.translation);
    const double pixels_per_dm = photo.camera.focal_px / std::max(distance, 1e-6);
    for (size_t c = 0; c < 3; ++c) mean_of_all[c] += sums[c];
    weight_of_all += weight;
    for (size_t i = 0; i < one.weights.size(); ++i) {
      if (one.weights[i] <= 0) continue;
      const float share = float(double(one.weights[i]) * double(one.weights[i]) * pixels_per_dm * pixels_per_dm);
      for (size_t c = 0; c < 3; ++c) {
        all.values[3 * i + c] += share * (one.values[3 * i + c] - float(sums[c] / weight));
      }
      shares[i] += share;
      all.weights[i] = std::max(all.weights[i], one.weights[i]);
    }
  }
  for (size_t i = 0; i < shares.size(); ++i) {
    if (shares[i] <= 0) continue;
    for (size_t c = 0; c < 3; ++c) {
      all.values[3 * i + c] = all.values[3 * i + c] / shares[i] + float(mean_of_all[c] / weight_of_all);
    }
  }
  return all;
}

void leave_out_collars(const Texels& texels, int side, Differences& seen) {
  double sum = 0, weight = 0;
  for (size_t i = 0; i < seen.weights.size(); ++i) {
    if (seen.weights[i] <= 0) continue;
    sum += double(seen.weights[i]) * luma(&seen.values[3 * i]), weight += double(seen.weights[i]);
  }
  if (weight <= 0) return;
  for (size_t i = 0; i < seen.weights.size(); ++i) {
    if (seen.weights[i] <= 0 || texels.is_cap[i] != 0) continue;
    const size_t row = i / size_t(side), column = i % size_t(side);
    if (std::hypot(double(row) + 0.5 - 0.5 * side, double(column) + 0.5 - 0.5 * side) < kNeckFraction * side) continue;
    const double off = std::abs(luma(&seen.values[3 * i]) - sum / weight);
    seen.weights[i] *= float(1 - smooth_step(off, kFirstCollar, kWholeCollar));
  }
}

// Returns a colour for each channel: the fraction kDarkestFraction of the mesh's colours that photos show is darker.
std::array<float, 3> darkest_seen(const Texels& texels, const std::vector<float>& weights) {
  std::array<std::array<double, 256>, 3> histograms{};
  double total = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] <= 0) continue;
    total += double(weights[i]);
    for (size_t c = 0; c < 3; ++c) {
      histograms[c][size_t(std::clamp(texels.colours[3 * i + c], 0.0f, 255.0f))] += double(weights[i]);
    }
  }
  std::array<float, 3> darkest{};
  for (size_t c = 0; c < 3; ++c) {
    size_t value = 0;
    double below = 0;
    while (value < 255 && below + histograms[c][value] <= kDarkestFraction * total) below += histograms[c][value++];
    darkest[c] = total > 0 ? float(value) : 0;
  }
  return darkest;
}

// For each channel, the mean strength of the light on the part that the photos show.
std::array<double, 3> mean_strength(const PhotoLight& light, const Texels& texels, const std::vector<float>& weights) {
  std::array<double, 3> sums{};
  double total = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] <= 0) continue;
    total += double(weights[i]);
    for (size_t c = 0; c < 3; ++c) sums[c] += double(weights[i]) * light[c].strength(&texels.normals[3 * i]);
  }
  for (double& sum : sums) sum = total > 0 ? sum / total : 0;
  return sums;
}

// The mesh's colours are converted to the photos' light; differences are then relative to them.
PhotoLight match_light(Texels& texels, Differences& seen) {
  const PhotoLight light = fit_photo_light(seen.weights, texels.colours, seen.values, texels.normals);
  const std::array<double, 3> even = mean_strength(light, texels, seen.weights);
  const std::array<float, 3> darkest = darkest_seen(texels, seen.weights);
  for (size_t i = 0; i < seen.weights.size(); ++i) {
    if (texels.is_surface[i] == 0 || texels.is_cap[i] != 0) continue;
    for (size_t c = 0; c < 3; ++c) {
      float& own = texels.colours[3 * i + c];
      const double known = double(std::max(own, darkest[c]));
      const double directed = light[c].strength(&texels.normals[3 * i]) * known + light[c].offset;
      double in_light = std::clamp(std::max(directed, kMinLight * (even[c] * known + light[c].offset)), 0.0, 255.0);
      if (double(own) < known) in_light *= double(own) / known;
      if (seen.weights[i] > 0) seen.values[3 * i + c] += own - float(in_light);
      own = float(in_light);
    }
  }
  return light;
}

// Removes the directional light from the mesh's colours and from what photos show.
void even_light(const PhotoLight& light, Texels& texels, Differences& seen) {
  const std::array<double, 3> even = mean_strength(light, texels, seen.weights);
  for (size_t i = 0; i < seen.weights.size(); ++i) {
    if (texels.is_surface[i] == 0 || texels.is_cap[i] != 0) continue;
    for (size_t c = 0; c < 3; ++c) {
      float& own = texels.colours[3 * i + c];
      const float before = own + seen.values[3 * i + c];
      own = light[c].evened(own, &texels.normals[3 * i], even[c], kMinLight);
      if (seen.weights[i] > 0) {
        seen.values[3 * i + c] = light[c].evened(before, &texels.normals[3 * i], even[c], kMinPhotoLight) - own;
      }
    }
  }
}

}  // namespace

HeadCamera crop_camera(const HeadCamera& camera, const AffineMap& to_crop, int side_px) {
  const double scale = std::hypot(to_crop.xx, to_crop.yx);
  const double cosine = to_crop.xx / scale, sine = to_crop.yx / scale;
  const RigidMotion turn{{cosine, -sine, 0, sine, cosine, 0, 0, 0, 1}, {}};
  HeadCamera made;
  made.head_to_camera = turn * camera.head_to_camera;
  made.focal_px = scale * camera.focal_px;
  const Point middle = to_crop({camera.cx_px + 0.5, camera.cy_px + 0.5});
  made.cx_px = middle.x - 0.5, made.cy_px = middle.y - 0.5;
  made.width_px = made.height_px = side_px;
  return made;
}

TextureImage bake_texture(const HeadMesh& mesh, const std::vector<TexturePhoto>& photos, const TextureOptions& options,
                          WorkerThreads& threads, const TextureImage& earlier) {
  const int side = options.side_px;
  if (side < kMinTexture_px || side > kMaxTexture_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The texture has ", side, " pixels a side, but must have ", kMinTexture_px,
                " to ", kMaxTexture_px, ".");
  }
  Texels texels = draw_texels(mesh, side, threads);
  const std::vector<float> hair = hair_fractions(texels, side);
  if (earlier.side_px > 0) take_colours(earlier, side, texels);
  Differences seen = blend(photos, mesh, texels, side, threads);
  leave_out_collars(texels, side, seen);
  const PhotoLight light = match_light(texels, seen);
  if (options.delight) even_light(light, texels, seen);
  std::vector<float> around(seen.values.size());
  if (earlier.side_px == 0) {
    seen = mirrored(seen, texels, side);
    around = colours_of_classes(seen, texels, hair, side);
  }
  go_on_from_known(seen, side, around);
  const size_t count = texels.is_surface.size();
  std::vector<float> colours(3 * count), is_known(count);
  double from_photos = 0, all = 0;
  for (size_t i = 0; i < count; ++i) {
    if (texels.is_surface[i] == 0) continue;
    is_known[i] = 1;
    const float known = seen.weights[i];
    const float unknown = texels.is_cap[i] != 0 ? 0 : 1 - known;
    for (size_t c = 0; c < 3; ++c) {
      float& colour = colours[3 * i + c];
      colour = texels.colours[3 * i + c] + known * seen.values[3 * i + c] + unknown * around[3 * i + c];
    }
    if (texels.is_cap[i] == 0) from_photos += double(known), all += 1;
  }
  fill_smoothly(side, is_known, colours);  // filters look beyond the border
  TextureImage image;
  image.side_px = side;
  image.photo_fraction = all > 0 ? from_photos / all : 0;
  image.bgr.resize(3 * count);
  for (size_t i = 0; i < count; ++i) {
    for (size_t c = 0; c < 3; ++c) {
      image.bgr[3 * i + 2 - c] = uint8_t(std::clamp(std::lround(colours[3 * i + c]), 0L, 255L));
    }
  }
  return image;
}

}  // namespace maq::head
