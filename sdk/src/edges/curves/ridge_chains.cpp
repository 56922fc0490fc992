#include "edges/curves/ridge_chains.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr float kMinCoherence = 0.55f;  // of the votes' directions: less is a corner, or noise
constexpr int kMaxGap_px = 3;           // px: chains bridge gaps up to here
constexpr int kWindow = 10;             // points before and after a turn
constexpr int kRounded = 2;             // points of the turn itself, on either side
constexpr int kMaxHook = 3;             // points at a chain's end that may be of the corner's other curves
constexpr float kHookCosine = 0.966f;   // 15 degrees from the direction four points further in

float value_at(const std::vector<float>& plane, int width, int height, float x, float y) {
  const int left = std::clamp(int(std::floor(x)), 0, width - 2), top = std::clamp(int(std::floor(y)), 0, height - 2);
  const float fx = std::clamp(x - float(left), 0.0f, 1.0f), fy = std::clamp(y - float(top), 0.0f, 1.0f);
  const float* at = &plane[size_t(top) * size_t(width) + size_t(left)];
  const float upper = at[0] + fx * (at[1] - at[0]), lower = at[width] + fx * (at[width + 1] - at[width]);
  return upper + fy * (lower - upper);
}

// How far points are from the straight line of least squares through them: mean of squares; the line.
struct Straight {
  double cx, cy, tx, ty, variance;
};

Straight straight_through(const RidgePoint* points, int count) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  for (int i = 0; i < count; ++i) {
    const double x = points[i].x - points[0].x, y = points[i].y - points[0].y;
    sx += x, sy += y, sxx += x * x, sxy += x * y, syy += y * y;
  }
  const double cx = sx / count, cy = sy / count;
  const double xx = sxx / count - cx * cx, xy = sxy / count - cx * cy, yy = syy / count - cy * cy;
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy), tx = std::cos(angle), ty = std::sin(angle);
  const double variance = std::max(0.0, xx * ty * ty - 2 * xy * tx * ty + yy * tx * tx);
  const double along = (points[count - 1].x - points[0].x) * tx + (points[count - 1].y - points[0].y) * ty;
  const double sign = along < 0 ? -1 : 1;
  return {cx + points[0].x, cy + points[0].y, sign * tx, sign * ty, variance};
}

// The same for one circle through the points before and after a turn: how a smooth curve fits.
double circle_variance(const RidgePoint* before, int count_before, const RidgePoint* after, int count_after) {
  const int count = count_before + count_after;
  const auto point = [&](int i) { return i < count_before ? before[i] : after[i - count_before]; };
  double cx = 0, cy = 0;
  for (int i = 0; i < count; ++i) cx += point(i).x, cy += point(i).y;
  cx /= count, cy /= count;
  // x^2 + y^2 = 2 a x + 2 b y + c around the middle, where sums of x and y are 0; c is the mean of the left side.
  double xx = 0, xy = 0, yy = 0, xs = 0, ys = 0, s = 0, ss = 0;
  for (int i = 0; i < count; ++i) {
    const double x = point(i).x - cx, y = point(i).y - cy, square = x * x + y * y;
    xx += x * x, xy += x * y, yy += y * y, xs += x * square, ys += y * square, s += square, ss += square * square;
  }
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 1e-9 * xx * xx + 1e-9 * yy * yy)) return 0;  // on one line
  const double a = (yy * xs - xy * ys) / determinant / 2, b = (xx * ys - xy * xs) / determinant / 2;
  const double left = ss - s * s / count - 2 * (a * xs + b * ys), radius_squared = s / count + a * a + b * b;
  return std::max(0.0, left / count / (4 * radius_squared));
}

}  // namespace

void RidgeChains::find_crests(const RidgeVotes& votes, float least) {
  const int width = votes.width, height = votes.height;
  crests_.clear();
  crest_of_.assign(size_t(width) * size_t(height), 0);
  for (int y = 1; y + 1 < height; ++y) {
    for (int x = 1; x + 1 < width; ++x) {
      const size_t at = size_t(y) * size_t(width) + size_t(x);
      const float here = votes.weight[at];
      if (!(here >= least)) continue;
      const float coherence = std::hypot(votes.cos2[at], votes.sin2[at]);
      if (!(coherence >= kMinCoherence * here)) continue;
      const float angle = 0.5f * std::atan2(votes.sin2[at], votes.cos2[at]), nx = std::cos(angle), ny = std::sin(angle);
      const float before = value_at(votes.weight, width, height, float(x) - nx, float(y) - ny);
      const float after = value_at(votes.weight, width, height, float(x) + nx, float(y) + ny);
      if (!(here > before && here >= after)) continue;
      const float bend = before - 2 * here + after;
      const float off = bend < 0 ? std::clamp(0.5f * (before - after) / bend, -0.7f, 0.7f) : 0.0f;
      crests_.push_back({float(x) + off * nx, float(y) + off * ny, nx, ny});
      crest_of_[at] = int(crests_.size());
    }
  }
  is_used_.assign(crests_.size(), 0);
}

// Appends the crests onward from `from`, which is in no chain yet beyond it.
void RidgeChains::follow(RidgePoint from, int width, int height) {
  for (size_t step = 0; step < crests_.size(); ++step) {
    const int px = int(std::lround(from.x)), py = int(std::lround(from.y));
    int best = -1;
    float least = INFINITY;
    RidgePoint next{};
    for (int y = std::max(0, py - kMaxGap_px - 1); y <= std::min(height - 1, py + kMaxGap_px + 1); ++y) {
      for (int x = std::max(0, px - kMaxGap_px - 1); x <= std::min(width - 1, px + kMaxGap_px + 1); ++x) {
        const int crest = crest_of_[size_t(y) * size_t(width) + size_t(x)] - 1;
        if (crest < 0 || is_used_[size_t(crest)]) continue;
        const Crest& c = crests_[size_t(crest)];
        const float dx = c.x - from.x, dy = c.y - from.y, distance = std::hypot(dx, dy);
        const float along = dx * from.tx + dy * from.ty, across = std::abs(dy * from.tx - dx * from.ty);
        if (distance < 0.7f) {  // the same place twice, on the stairs of a slanted crest
          is_used_[size_t(crest)] = 1;
          continue;
        }
        if (distance > float(kMaxGap_px) + 0.5f || along < 0.6f * distance) continue;
        float tx = -c.ny, ty = c.nx;
        const float agrees = tx * from.tx + ty * from.ty;
        if (std::abs(agrees) < 0.6f) continue;
        if (agrees < 0) tx = -tx, ty = -ty;
        const float cost = along + 2 * across;
        if (cost < least) {
          least = cost, best = crest;
          next = {c.x, c.y, tx, ty};
        }
      }
    }
    if (best < 0) return;
    is_used_[size_t(best)] = 1;
    points.push_back(next);
    from = next;
  }
}

void RidgeChains::keep(int first, int count, bool is_closed, const CurveOptions& options, CurveCounts& counts) {
  const auto is_hook = [&](int at, int inward) {
    const RidgePoint &a = points[size_t(at)], &b = points[size_t(at + inward)];
    return a.tx * b.tx + a.ty * b.ty < kHookCosine;
  };
  for (int i = 0; i < kMaxHook && !is_closed && count > 12 && is_hook(first, 4); ++i) ++first, --count;
  for (int i = 0; i < kMaxHook && !is_closed && count > 12 && is_hook(first + count - 1, -4); ++i) --count;
  double length = 0;
  for (int i = first + 1; i < first + count; ++i) {
    const RidgePoint &a = points[size_t(i) - 1], &b = points[size_t(i)];
    length += std::hypot(double(b.x) - a.x, double(b.y) - a.y);
  }
  if (count < 4 || length < double(options.min_length_px) - 3) {  // a corner hides 1 to 2 px of each end
    ++counts.short_chains;
  } else if (int(chains.size()) >= options.max_curves) {
    ++counts.over_limit;
  } else {
    chains.push_back({first, count, is_closed});
  }
}

// A turn is sharp where two straight lines through the points before and after it fit better than one smooth curve. The
// points of the turn itself are rounded by the smoothing of votes.
void RidgeChains::part_at_turns(RidgeChain chain, const CurveOptions& options, CurveCounts& counts) {
  const int n = chain.count;
  const RidgePoint* p = points.data() + chain.first;
  turns_.assign(size_t(n), 0.0f);
  const double least = double(kSplitAngleDeg) * (3.14159265358979 / 180);
  for (int i = 4 + kRounded; i + 4 + kRounded < n; ++i) {
    const int before = std::min(i - kRounded, kWindow), after = std::min(n - 1 - i - kRounded, kWindow);
    const RidgePoint *head = p + i - kRounded - before, *tail = p + i + kRounded + 1;
    const Straight a = straight_through(head, before), b = straight_through(tail, after);
    const double turn = std::abs(std::atan2(a.tx * b.ty - a.ty * b.tx, a.tx * b.tx + a.ty * b.ty));
    if (turn < least) continue;
    const double two = (a.variance * before + b.variance * after) / (before + after);
    if (two > 0.6 * circle_variance(head, before, tail, after)) continue;
    turns_[size_t(i)] = float(turn / (0.02 + two));  // the sharpest place: where the lines fit best
  }
  int begin = 0;
  const auto is_top = [&](int i) {
    for (int k = std::max(0, i - kWindow / 2); k <= std::min(n - 1, i + kWindow / 2); ++k) {
      if (turns_[size_t(k)] > turns_[size_t(i)] || (turns_[size_t(k)] == turns_[size_t(i)] && k < i)) return false;
    }
    return true;
  };
  for (int i = 0; i < n; ++i) {
    if (turns_[size_t(i)] == 0 || !is_top(i)) continue;
    keep(chain.first + begin, i - kRounded - begin + 1, false, options, counts);
    begin = i + kRounded;
  }
  keep(chain.first + begin, n - begin, chain.is_closed && begin == 0, options, counts);
}

void RidgeChains::trace(const RidgeVotes& votes, const CurveOptions& options, CurveCounts& counts) {
  points.clear();
  chains.clear();
  if (votes.width < 3 || votes.height < 3) return;
  find_crests(votes, 0.5f * kMinVotes);
  for (size_t seed = 0; seed < crests_.size(); ++seed) {
    const Crest& crest = crests_[seed];
    if (is_used_[seed]) continue;
    const int x = int(std::lround(crest.x)), y = int(std::lround(crest.y));
    if (value_at(votes.weight, votes.width, votes.height, float(x), float(y)) < kMinVotes) continue;
    is_used_[seed] = 1;
    ++counts.chains;
    const auto first = points.size();
    const RidgePoint start{crest.x, crest.y, -crest.ny, crest.nx};
    follow({start.x, start.y, -start.tx, -start.ty}, votes.width, votes.height);
    std::reverse(points.begin() + std::ptrdiff_t(first), points.end());
    for (size_t i = first; i < points.size(); ++i) points[i].tx = -points[i].tx, points[i].ty = -points[i].ty;
    points.push_back(start);
    follow(start, votes.width, votes.height);
    const int count = int(points.size() - first);
    const RidgePoint &head = points[first], &tail = points.back();
    const bool is_closed = count >= 16 && std::hypot(head.x - tail.x, head.y - tail.y) <= float(kMaxGap_px) + 0.5f &&
                           head.tx * tail.tx + head.ty * tail.ty > 0.5f;
    part_at_turns({int(first), count, is_closed}, options, counts);
  }
}

}  // namespace maq
