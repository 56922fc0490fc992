// Textures of meshes: their levels, and images of meshes with them.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "head/mesh/mesh_raster.h"
#include "head/mesh/mesh_texture.h"

namespace mesh_texture_tests {

using maq::Frame;
using maq::RenderedImage;
using maq::WorkerThreads;
using maq::head::HeadCamera;
using maq::head::HeadMesh;
using maq::head::MeshRaster;
using maq::head::MeshShading;
using maq::head::MeshTexture;
using maq::head::RasterOptions;

// Creates a texture from a function of row and column that returns B, G, R.
template <class Colour>
MeshTexture texture_of(int width_px, int height_px, Colour colour) {
  Frame frame;
  uint8_t* pixel = frame.allocate_bgr(width_px, height_px);
  for (int row = 0; row < height_px; ++row) {
    for (int column = 0; column < width_px; ++column) {
      for (const int value : colour(row, column)) *pixel++ = uint8_t(value);
    }
  }
  return MeshTexture(frame.image);
}

using Bgr = std::array<int, 3>;

// A square of 2 a side, 6 before the camera, whose texture is seen upright.
HeadMesh square() {
  HeadMesh mesh;
  mesh.positions = {-1, 0, 1, 1, 0, 1, -1, 0, -1, 1, 0, -1};
  mesh.normals = {0, -1, 0, 0, -1, 0, 0, -1, 0, 0, -1, 0};
  mesh.colours.assign(12, 77);
  mesh.texture_coordinates = {0, 0, 1, 0, 0, 1, 1, 1};
  mesh.triangles = {0, 2, 1, 1, 2, 3};
  return mesh;
}

// In which the square is `side_px` wide and fills the image.
HeadCamera camera_of(int side_px) {
  HeadCamera camera;
  camera.width_px = camera.height_px = side_px;
  camera.head_to_camera.rotation = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  camera.head_to_camera.translation = {0, 0, 6};
  camera.focal_px = 3 * side_px, camera.cx_px = camera.cy_px = (side_px - 1) / 2.0;
  return camera;
}

RenderedImage picture_of(const HeadMesh& mesh, const MeshTexture* texture, int side_px,
                         MeshShading shading = MeshShading::kColour) {
  WorkerThreads threads(2);
  MeshRaster raster;
  RenderedImage image;
  RasterOptions options;
  options.ambient = 1;
  options.shading = shading;
  options.texture = texture;
  raster.draw(mesh, camera_of(side_px), options, threads, image);
  return image;
}

TEST(MeshTexture, ALevelIsTheMeanOfFourTexelsOfTheOneBefore) {
  const MeshTexture texture = texture_of(5, 4, [](int row, int column) {
    return Bgr{40 * row, 50 * column, row == column ? 100 : 0};
  });
  // The middle of the left upper texel of the first level, 2 x 2: the rightmost column of the whole image is left
  // out.
  const std::array<float, 3> corner = texture.colour(0.25f, 0.25f, 1);
  EXPECT_NEAR(corner[0], 50, 0.51);
  EXPECT_NEAR(corner[1], 25, 0.51);
  EXPECT_NEAR(corner[2], 20, 0.51);
  const std::array<float, 3> all = texture.colour(0.9f, 0.1f, 2);
  EXPECT_NEAR(all[1], 75, 1.1);
  EXPECT_NEAR(all[2], 60, 1.1);
}

TEST(MeshTexture, IsMixedBetweenTheMiddlesOfTexelsAndGoesOnBeyondTheLast) {
  const MeshTexture texture = texture_of(2, 1, [](int, int column) { return Bgr{0, 0, 200 * column}; });
  for (const auto& [u, red] : {std::pair(0.25f, 0.0f), {0.5f, 100.0f}, {0.625f, 150.0f}, {0.75f, 200.0f}}) {
    EXPECT_NEAR(texture.colour(u, 0.5f, 0)[0], red, 1e-3) << u;
  }
  EXPECT_EQ(texture.colour(-1e30f, 7, 0)[0], 0);
  EXPECT_EQ(texture.colour(1e30f, -7, 0)[0], 200);
  const float none = std::numeric_limits<float>::quiet_NaN(), far = std::numeric_limits<float>::infinity();
  EXPECT_EQ(texture.colour(none, none, 0)[0], 0);
  EXPECT_EQ(texture.colour(far, -far, 0)[0], 200);
}

TEST(MeshTexture, ATexelIsAboutAsLargeAsAPixel) {
  const MeshTexture texture = texture_of(64, 64, [](int, int) { return Bgr{1, 2, 3}; });
  EXPECT_EQ(texture.level_of(1, 100), 0);
  EXPECT_EQ(texture.level_of(1.9, 1), 0);
  EXPECT_EQ(texture.level_of(2.1, 1), 1);
  EXPECT_EQ(texture.level_of(16, 1), 2);
  EXPECT_EQ(texture.level_of(1e9, 1), 6) << "the last has one texel";
  EXPECT_EQ(texture.level_of(1, 0), 6);
  EXPECT_EQ(texture.level_of(0, 0), 0) << "of triangles without an area anything will do";
  EXPECT_EQ(texture_of(1, 9, [](int, int) { return Bgr{1, 2, 3}; }).level_of(1e9, 1), 0);
}

TEST(MeshTexture, AMeshShowsItWhereItsCoordinatesSay) {
  const auto colour = [](int row, int column) { return Bgr{8 * row, 8 * column, (row * column) % 7 * 30}; };
  const MeshTexture texture = texture_of(32, 32, colour);
  const RenderedImage image = picture_of(square(), &texture, 32);
  for (int row = 1; row < 31; ++row) {
    for (int column = 1; column < 31; ++column) {
      for (size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(image.bgr[3 * size_t(32 * row + column) + c], colour(row, column)[c], 1) << row << ", " << column;
      }
    }
  }
  HeadMesh without = square();
  without.texture_coordinates.clear();
  EXPECT_EQ(picture_of(without, &texture, 32).bgr[3 * (32 * 16 + 16)], 77) << "no coordinates";
  EXPECT_EQ(picture_of(square(), nullptr, 32).bgr[3 * (32 * 16 + 16)], 77) << "no texture";
  EXPECT_EQ(picture_of(square(), &texture, 32, MeshShading::kShape).bgr[3 * (32 * 16 + 16)], 200);
}

TEST(MeshTexture, FarAwayItIsItsMeanAndNoPattern) {
  // A chessboard whose squares are far smaller than a pixel.
  const MeshTexture texture = texture_of(512, 512, [](int row, int column) {
    const int value = (row + column) % 2 * 200;
    return Bgr{value, value, value};
  });
  const RenderedImage image = picture_of(square(), &texture, 16);
  for (size_t i = 0; i < image.alpha.size(); ++i) {
    if (image.alpha[i] == 255) {
      EXPECT_NEAR(image.bgr[3 * i], 100, 1) << i;
    }
  }
}

}  // namespace mesh_texture_tests
