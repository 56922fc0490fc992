// Lenses with distortion against OpenCV's projection, and images without it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <random>

#include "image/geometry/lens.h"
#include "image/geometry/undistort.h"
#include "support/expect_error.h"

namespace {

using maq::Distortion;
using maq::Lens;

Lens rational() {
  return {
      {640, 480, 520, 498, 331.5, 228.25}, Distortion::kRational, {-.21, .07, .0013, -.0021, .011, .05, -.02, .004}};
}
Lens fisheye() { return {{640, 480, 520, 498, 331.5, 228.25}, Distortion::kFisheye, {.03, -.011, .004, -.0009}}; }

struct Ray {
  double x, y, column_px, row_px;
};

void expect_rays(const Lens& lens, const std::vector<Ray>& rays) {
  const maq::LensProjection projection(lens);
  for (const Ray& ray : rays) {
    const auto at = projection.find(ray.x, ray.y);
    ASSERT_TRUE(at) << ray.x << ", " << ray.y;
    EXPECT_NEAR(at->column_px, ray.column_px, 1e-9) << ray.x << ", " << ray.y;
    EXPECT_NEAR(at->row_px, ray.row_px, 1e-9) << ray.x << ", " << ray.y;
  }
}

// Results of cv2.projectPoints of OpenCV 5.0.0 for points (x, y, 1) and the lens above.
TEST(Lenses, TheRationalModelIsThatOfOpenCv) {
  expect_rays(rational(), {{0, 0, 331.500000000000, 228.250000000000},
                           {0.1, -0.05, 383.289586538904, 203.452311926563},
                           {-0.4, 0.3, 134.904677888882, 369.424133285582},
                           {0.62, 0.46, 614.521906786856, 430.198353505747},
                           {-0.62, -0.47, 46.678850916374, 22.343709319077},
                           {0.3, 0.5, 475.187861229817, 458.410668347592}});
}

// Results of cv2.fisheye.projectPoints for the same points.
TEST(Lenses, TheFisheyeModelIsThatOfOpenCv) {
  expect_rays(fisheye(), {{0, 0, 331.500000000000, 228.250000000000},
                          {0.1, -0.05, 383.304115876645, 203.443798359068},
                          {-0.4, 0.3, 137.469465770541, 367.616162566736},
                          {0.62, 0.46, 609.129908127917, 425.518794522156},
                          {-0.62, -0.47, 54.410067408481, 27.084771642770},
                          {0.3, 0.5, 473.803878942169, 455.388883696154}});
}

TEST(Lenses, WithoutDistortionItIsThePinhole) {
  expect_rays({{100, 50, 80, 90, 10, 20}}, {{0, 0, 10, 20}, {1, 2, 90, 200}, {-300, 0, -23990, 20}});
}

TEST(Lenses, WhereTheDistortionFoldsBackThereIsNoPlace) {
  Lens lens = rational();
  lens.coefficients = {-0.6};  // r (1 - 0.6 r^2) has its top at r = 0.745
  const maq::LensProjection projection(lens);
  EXPECT_TRUE(projection.find(0.74, 0));
  EXPECT_FALSE(projection.find(0.75, 0));
  EXPECT_FALSE(projection.find(-0.6, 0.6));
  EXPECT_FALSE(projection.find(std::numeric_limits<double>::quiet_NaN(), 0));
}

// The least focal length with which nothing is blank: all pixels have a place, and with a hundredth less some have
// none.
TEST(Lenses, TheUndistortedPictureIsAsWideAsItCanBeWithoutABlank) {
  for (Lens lens : {rational(), fisheye(), Lens{{300, 200, 150, 150, 149.5, 99.5}, Distortion::kRational, {0.2}},
                    Lens{{300, 200, 100, 100, 120, 110}, Distortion::kFisheye}}) {
    const auto found = maq::without_distortion(lens);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->distortion, Distortion::kNone);
    EXPECT_EQ(found->width_px, lens.width_px);
    EXPECT_EQ(found->cx_px, lens.cx_px);
    EXPECT_NEAR(found->fx_px / found->fy_px, lens.fx_px / lens.fy_px, 1e-12);
    const maq::LensProjection projection(lens);
    const auto blanks = [&](double factor) {
      int count = 0;
      for (int y = 0; y < lens.height_px; ++y) {
        for (int x = 0; x < lens.width_px; ++x) {
          const auto at = projection.find((x - found->cx_px) / (found->fx_px * factor),
                                          (y - found->cy_px) / (found->fy_px * factor));
          const bool is_inside = at && at->column_px >= -0.5 && at->column_px <= lens.width_px - 0.5 &&
                                 at->row_px >= -0.5 && at->row_px <= lens.height_px - 0.5;
          count += !is_inside;
        }
      }
      return count;
    };
    EXPECT_EQ(blanks(1), 0);
    EXPECT_GT(blanks(0.99), 0);
  }
}

TEST(Lenses, OneWhoseAxisIsOutsideOrWhosePictureFoldsHasNoUndistortedPicture) {
  Lens lens = rational();
  lens.cx_px = -20;
  EXPECT_FALSE(maq::without_distortion(lens));
  lens = rational();
  lens.coefficients = {-1e6};
  EXPECT_FALSE(maq::without_distortion(lens));
  lens.coefficients = {1e300, -1e300, 1e300, 1e300};
  EXPECT_FALSE(maq::without_distortion(lens));
}

TEST(Lenses, ASmallerPictureSeesTheSame) {
  const Lens lens = rational(), half = maq::resized(lens, 320, 240);
  for (const auto& [x, y] : {std::pair{0.1, 0.2}, {-0.5, 0.3}}) {
    const auto at = maq::LensProjection(lens).find(x, y), at_half = maq::LensProjection(half).find(x, y);
    EXPECT_NEAR((at->column_px + 0.5) / 2, at_half->column_px + 0.5, 1e-9);
    EXPECT_NEAR((at->row_px + 0.5) / 2, at_half->row_px + 0.5, 1e-9);
  }
}

// An image whose colours are the places of its pixels says where each pixel of the undistorted one came from.
TEST(Lenses, PixelsOfTheUndistortedPictureComeFromTheirPlaces) {
  for (Lens lens : {rational(), fisheye()}) {
    lens = maq::resized(lens, 200, 150);
    maq::Frame photo;
    uint8_t* pixels = photo.allocate_bgr(200, 150);
    for (int i = 0; i < 200 * 150; ++i) {
      pixels[3 * i] = uint8_t(i % 200);
      pixels[3 * i + 1] = uint8_t(i / 200);
      pixels[3 * i + 2] = 200;
    }
    Lens wide = *maq::without_distortion(lens);
    wide.fx_px *= 0.8;  // so that some pixels have no place
    wide.fy_px *= 0.8;
    maq::Frame picture;
    std::vector<uint8_t> valid;
    maq::undistort(photo.image, lens, wide, picture, valid);
    ASSERT_EQ(picture.image.width_px, 200);
    ASSERT_EQ(valid.size(), 200u * 150u);
    int blanks = 0;
    const maq::LensProjection projection(lens);
    for (int i = 0; i < 200 * 150; ++i) {
      const uint8_t* pixel = picture.storage.data() + 3 * i;
      const auto at = projection.find((i % 200 - wide.cx_px) / wide.fx_px, (i / 200 - wide.cy_px) / wide.fy_px);
      const bool is_inside =
          at && at->column_px >= -0.5 && at->column_px <= 199.5 && at->row_px >= -0.5 && at->row_px <= 149.5;
      ASSERT_EQ(valid[size_t(i)], is_inside ? 255 : 0) << i;
      if (is_inside) {
        ASSERT_NEAR(pixel[0], std::clamp(at->column_px, 0.0, 199.0), 0.6) << i;
        ASSERT_NEAR(pixel[1], std::clamp(at->row_px, 0.0, 149.0), 0.6) << i;
        ASSERT_EQ(pixel[2], 200);
      } else {
        ++blanks;
        ASSERT_EQ(pixel[0] + pixel[1] + pixel[2], 0) << i;
      }
    }
    EXPECT_GT(blanks, 100);
    EXPECT_LT(blanks, 15000);
  }
}

TEST(Lenses, ARowOfDirectionsFallsToTheBitWhereEachDoes) {
  std::vector<double> x;
  for (int i = -500; i <= 500; ++i) x.push_back(i * 0.0041 + 1e-7);
  Lens folding = rational();
  folding.coefficients = {-0.6};
  for (const Lens& lens : {rational(), fisheye(), folding, Lens{{100, 50, 80, 90, 10, 20}}}) {
    const maq::LensProjection projection(lens);
    int places = 0;
    for (const double y : {0.0, -0.3, 0.77, 1.9}) {
      std::vector<double> columns(x.size()), rows(x.size());
      projection.find_row(x, y, columns.data(), rows.data());
      for (size_t i = 0; i < x.size(); ++i) {
        const auto at = projection.find(x[i], y);
        ASSERT_EQ(std::isnan(columns[i]), !at) << x[i] << ", " << y;
        ASSERT_EQ(std::isnan(rows[i]), !at) << x[i] << ", " << y;
        if (!at) continue;
        ++places;
        ASSERT_EQ(columns[i], at->column_px) << x[i] << ", " << y;
        ASSERT_EQ(rows[i], at->row_px) << x[i] << ", " << y;
      }
    }
    EXPECT_GT(places, 100);
  }
}

// The places by the formula above, the pixels to the bit by cv::remap.
TEST(Lenses, UndistortedPicturesAreReadToTheBitAsOpenCvDoes) {
  const Lens lenses[] = {rational(),
                         fisheye(),
                         maq::resized(rational(), 333, 251),
                         maq::resized(fisheye(), 31, 17),
                         maq::resized(rational(), 2, 2),
                         maq::resized(rational(), 1, 1)};
  uint64_t seed = 1;
  for (const Lens& lens : lenses) {
    for (const double zoom : {0.7, 1.0, 1.6}) {
      cv::Mat whole(lens.height_px, lens.width_px + 5, CV_8UC3);
      cv::RNG random(seed++);
      random.fill(whole, cv::RNG::UNIFORM, 0, 256);
      if (seed % 2 == 0) whole = (whole > 127) / 255 * 255;
      const cv::Mat photo = whole(cv::Rect(0, 0, lens.width_px, lens.height_px));
      Lens straight = maq::resized(lens, lens.width_px + int(seed % 3), lens.height_px + int(seed % 5));
      straight.distortion = Distortion::kNone;
      straight.fx_px *= zoom;
      straight.fy_px *= zoom;
      cv::Mat columns(straight.height_px, straight.width_px, CV_32FC1), rows = columns.clone(), expected;
      const maq::LensProjection projection(lens);
      for (int y = 0; y < columns.rows; ++y) {
        for (int x = 0; x < columns.cols; ++x) {
          const auto at = projection.find((x - straight.cx_px) / straight.fx_px, (y - straight.cy_px) / straight.fy_px);
          columns.at<float>(y, x) = at ? float(at->column_px) : 0;
          rows.at<float>(y, x) = at ? float(at->row_px) : 0;
        }
      }
      cv::remap(photo, expected, columns, rows, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
      maq::Frame picture;
      std::vector<uint8_t> valid;
      maq::undistort({MAQ_PIXEL_BGR8, photo.cols, photo.rows, {{photo.data, photo.step}, {}}}, lens, straight, picture,
                     valid);
      for (int y = 0; y < columns.rows; ++y) {
        for (int x = 0; x < columns.cols; ++x) {
          const size_t i = size_t(y * columns.cols + x);
          if (valid[i] == 0) expected.at<cv::Vec3b>(y, x) = {};
          ASSERT_EQ(std::memcmp(expected.ptr(y, x), picture.storage.data() + 3 * i, 3), 0) << x << ", " << y;
        }
      }
    }
  }
}

TEST(Lenses, APictureOfAnotherSizeThanItsLensIsRefused) {
  maq::Frame photo, picture;
  photo.allocate_bgr(64, 48);
  std::vector<uint8_t> valid;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "64 x 48",
               [&] { maq::undistort(photo.image, rational(), rational(), picture, valid); });
}

TEST(Lenses, RandomFiguresNeverCrash) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> exponent(-3, 6), sign(-1, 1);
  const auto any = [&] { return (sign(random) < 0 ? -1 : 1) * std::pow(10.0, exponent(random)); };
  maq::Frame photo, picture;
  photo.allocate_bgr(20, 15);
  std::vector<uint8_t> valid;
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    Lens lens{{20, 15, std::abs(any()), std::abs(any()), any(), any()},
              i % 2 ? Distortion::kRational : Distortion::kFisheye};
    for (double& value : lens.coefficients) value = any() * (i % 3 ? 1e-4 : 1);
    if (i % 5 == 0) lens.cx_px = 9, lens.cy_px = 7;
    const auto undistorted = maq::without_distortion(lens);
    if (!undistorted) continue;
    ++found;
    maq::undistort(photo.image, lens, *undistorted, picture, valid);
    EXPECT_EQ(std::count(valid.begin(), valid.end(), 0), 0) << i;
  }
  EXPECT_GT(found, 5);
}

}  // namespace
