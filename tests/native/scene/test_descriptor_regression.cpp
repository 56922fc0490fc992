// The regression of NPBG++ against sums and a solution in long double, over the extreme cases.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "scene/assembly/descriptor_regression.h"

namespace {

using maq::DescriptorKind;
using maq::kBasis;
using maq::kFeatures;
using Feature = std::array<float, kFeatures>;
using Basis = std::array<float, kBasis>;
struct View {
  Feature y;
  Basis h;
};

// A smooth basis of the direction, such as a small network gives: all six values differ, none is 0.
Basis basis_of(double x, double y, double z) {
  Basis h;
  for (int i = 0; i < kBasis; ++i) {
    h[size_t(i)] = float(std::sin(1.3 * x * (i + 1) + 0.7 * y - 0.4 * i * z + 0.3 * i) + 0.2 * (i - 2) * y * z);
  }
  return h;
}

// The equations of the paper as they are written: uncentred sums.
class Reference {
 public:
  void add(const View& view) {
    ++views_;
    for (int c = 0; c < kFeatures; ++c) sum_y_[c] += view.y[size_t(c)];
    for (int i = 0; i < kBasis; ++i) {
      sum_h_[i] += view.h[size_t(i)];
      for (int j = 0; j < kBasis; ++j) sum_hh_[i][j] += (long double)view.h[size_t(i)] * view.h[size_t(j)];
      for (int c = 0; c < kFeatures; ++c) sum_hy_[i][c] += (long double)view.h[size_t(i)] * view.y[size_t(c)];
    }
  }

  // By Gauss and Jordan with pivots.
  void solve(long double alpha) {
    long double rows[kBasis][kBasis + kFeatures];
    for (int i = 0; i < kBasis; ++i) {
      for (int j = 0; j < kBasis; ++j) rows[i][j] = sum_hh_[i][j] + (i == j ? alpha : 0);
      for (int c = 0; c < kFeatures; ++c) rows[i][kBasis + c] = sum_hy_[i][c] - sum_h_[i] * sum_y_[c] / views_;
    }
    for (int i = 0; i < kBasis; ++i) {
      int best = i;
      for (int k = i + 1; k < kBasis; ++k) {
        if (std::abs(rows[k][i]) > std::abs(rows[best][i])) best = k;
      }
      std::swap_ranges(rows[i], rows[i] + kBasis + kFeatures, rows[best]);
      for (int k = 0; k < kBasis; ++k) {
        if (k == i) continue;
        const long double factor = rows[k][i] / rows[i][i];
        for (int j = i; j < kBasis + kFeatures; ++j) rows[k][j] -= factor * rows[i][j];
      }
    }
    for (int i = 0; i < kBasis; ++i) {
      for (int c = 0; c < kFeatures; ++c) beta_[i][c] = rows[i][kBasis + c] / rows[i][i];
    }
  }

  double fitted(const Basis& h, int c) const {
    long double value = sum_y_[c] / views_;
    for (int i = 0; i < kBasis; ++i) value += beta_[i][c] * h[size_t(i)];
    return double(value);
  }

 private:
  long double views_ = 0, sum_y_[kFeatures] = {}, sum_h_[kBasis] = {}, sum_hh_[kBasis][kBasis] = {};
  long double sum_hy_[kBasis][kFeatures] = {}, beta_[kBasis][kFeatures] = {};
};

struct Fit {
  explicit Fit(const std::vector<View>& views, double alpha = 1) {
    for (const View& view : views) regression.add(view.y.data(), view.h.data());
    outcome = maq::solve_descriptor(regression, alpha, beta);
  }
  double at(const Basis& h, int c) const {
    double value = regression.mean_y[c];
    for (int i = 0; i < kBasis; ++i) value += double(beta[i][c]) * h[size_t(i)];
    return value;
  }
  bool is_constant() const {
    return std::all_of(&beta[0][0], &beta[0][0] + kBasis * kFeatures, [](float value) { return value == 0; });
  }
  maq::DescriptorRegression regression{};
  float beta[kBasis][kFeatures];
  DescriptorKind outcome;
};

// Views from within `spread` of one direction, of a view-dependent descriptor, with noise.
std::vector<View> views_around(int count, double spread, unsigned seed, double scale = 1, double noise = 0.02) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<View> views(size_t(count), View{});
  for (View& view : views) {
    const double x = 0.3 + spread * normal(random), y = -0.5 + spread * normal(random);
    view.h = basis_of(x, y, std::sqrt(std::max(0.0, 1 - x * x - y * y)));
    for (int c = 0; c < kFeatures; ++c) {
      double value = 0.5 - 0.1 * c + noise * normal(random);
      for (int i = 0; i < kBasis; ++i) value += 0.3 * std::cos(double(i * c)) * view.h[size_t(i)];
      view.y[size_t(c)] = float(scale * value);
    }
  }
  return views;
}

// The largest difference from the reference over the directions that were seen, relative to the largest feature.
double error_of(const std::vector<View>& views, double alpha = 1) {
  Reference reference;
  for (const View& view : views) reference.add(view);
  reference.solve(alpha);
  const Fit fitted(views, alpha);
  double largest = 0, error = 0;
  for (size_t k = 0; k < views.size(); k += 1 + views.size() / 1000) {
    for (int c = 0; c < kFeatures; ++c) {
      largest = std::max(largest, std::abs(double(views[k].y[size_t(c)])));
      error = std::max(error, std::abs(fitted.at(views[k].h, c) - reference.fitted(views[k].h, c)));
    }
  }
  return error / largest;
}

TEST(DescriptorRegression, AnUnseenPointHasNoDescriptor) { EXPECT_EQ(Fit({}).outcome, DescriptorKind::kUnseen); }

TEST(DescriptorRegression, SeenOnceOrAlwaysFromOneDirectionTheDescriptorIsTheMean) {
  const std::vector<View> some = views_around(50, 0.3, 1);
  const Fit once({some[0]});
  EXPECT_EQ(once.outcome, DescriptorKind::kConstant);
  EXPECT_TRUE(once.is_constant());
  EXPECT_TRUE(std::equal(some[0].y.begin(), some[0].y.end(), once.regression.mean_y));
  std::vector<View> same = some;
  for (View& view : same) view.h = some[0].h;
  const Fit constant(same);
  EXPECT_EQ(constant.outcome, DescriptorKind::kConstant);
  EXPECT_TRUE(constant.is_constant()) << "exactly, although the features differ";
}

TEST(DescriptorRegression, DirectionsNearlyEqualFewAndMany) {
  for (const double spread : {0.5, 0.1, 1e-3, 1e-6}) {
    for (const int count : {2, 3, 5, 6, 7, 10, 100, 1000}) {
      for (const double alpha : {1.0, 1e-2}) {
        EXPECT_LE(error_of(views_around(count, spread, unsigned(count)), alpha), 1e-4)
            << count << " views within " << spread << " alpha " << alpha;
      }
    }
  }
}

TEST(DescriptorRegression, BasesOfAnyRank) {
  for (int rank = 1; rank <= kBasis; ++rank) {
    std::vector<View> views = views_around(200, 0.4, unsigned(rank));
    for (View& view : views) {
      for (int i = rank; i < kBasis; ++i) view.h[size_t(i)] = view.h[size_t(i - rank)];
    }
    EXPECT_LE(error_of(views), 1e-4) << rank;
    EXPECT_LE(error_of(views, 1e-2), 1e-4) << rank;
  }
}

// Condition numbers up to 1e12: one basis value of 1e6 times the others' size.
TEST(DescriptorRegression, BadlyConditionedSystems) {
  for (const double factor : {1e2, 1e4, 1e6}) {
    std::vector<View> views = views_around(300, 0.4, 9);
    for (View& view : views) view.h[2] = float(view.h[2] * factor);
    EXPECT_LE(error_of(views), 1e-4) << factor;
  }
  for (const double alpha : {1e-6, 1e-9}) EXPECT_LE(error_of(views_around(300, 0.4, 9), alpha), 1e-4) << alpha;
}

TEST(DescriptorRegression, WithoutRegularisationASingularSystemFallsBackToTheMean) {
  const Fit few(views_around(3, 0.4, 2), 0);
  EXPECT_EQ(few.outcome, DescriptorKind::kSingular);
  EXPECT_TRUE(few.is_constant());
  const std::vector<View> enough = views_around(300, 0.4, 3);
  EXPECT_EQ(Fit(enough, 0).outcome, DescriptorKind::kViewDependent);
  EXPECT_LE(error_of(enough, 0), 1e-4);
}

TEST(DescriptorRegression, ManyViewsInAnyOrder) {
  for (const int count : {10, 1000, 100000}) {
    std::vector<View> views = views_around(count, 0.4, 5);
    EXPECT_LE(error_of(views), 1e-4) << count;
    const Fit forwards(views);
    std::reverse(views.begin(), views.end());
    const Fit backwards(views);
    std::sort(views.begin(), views.end(), [](const View& a, const View& b) { return a.h[0] < b.h[0]; });
    const Fit sorted(views);
    for (size_t k = 0; k < views.size(); k += 1 + views.size() / 100) {
      for (int c = 0; c < kFeatures; ++c) {
        EXPECT_NEAR(backwards.at(views[k].h, c), forwards.at(views[k].h, c), 1e-4);
        EXPECT_NEAR(sorted.at(views[k].h, c), forwards.at(views[k].h, c), 1e-4);
      }
    }
  }
}

TEST(DescriptorRegression, FeaturesOfAnySize) {
  for (const double scale : {1e-6, 1e6}) EXPECT_LE(error_of(views_around(100, 0.4, 6, scale)), 1e-4) << scale;
  // A large constant with a small change on top: what is left of the change in float.
  std::vector<View> views = views_around(100, 0.4, 7);
  for (View& view : views) {
    for (float& value : view.y) value = 1000 + value;
  }
  EXPECT_LE(error_of(views), 1e-6);
}

TEST(DescriptorRegression, OutsideTheSeenDirectionsTheDescriptorStaysBounded) {
  for (const double spread : {1e-3, 1e-6}) {
    const Fit fitted(views_around(100, spread, 8));
    for (double angle = 0; angle < 6.3; angle += 0.1) {
      for (int c = 0; c < kFeatures; ++c) {
        EXPECT_LT(std::abs(fitted.at(basis_of(std::cos(angle), std::sin(angle), 0), c)), 10) << spread;
      }
    }
  }
}

}  // namespace
