#include "head/reconstruction/head_builder.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "core/clock.h"
#include "core/error.h"
#include "head/reconstruction/known_anchors.h"

namespace maq::head {
namespace {

// Fewer cells are no head, or too little of one: a head fills some 600 of 48 x 48 cells.
constexpr size_t kMinHeadCells = 40;
constexpr double kMinMatte = 0.5;
// The encoder may take another object for a head, but then its sigmas are large. Their medians are 0.04 to 0.08 for
// faces, up to 0.19 for backs of heads, and 0.12 to 0.5 for animals and rooms. A given box means that there is a head.
constexpr double kMaxFoundSigma_dm = 0.15, kMaxSigma_dm = 0.25;
// This fraction of the found cells may be strays on each side of the head's box.
constexpr double kStrayFraction = 0.01;
// Smaller heads cannot be fitted.
constexpr float kMinFoundSide_px = 8;
constexpr double kMinSearchedSide_px = 32;
constexpr int kMaxSearchedSquares = 7;  // a row, and a column
constexpr int kPassesAround = 2;        // encoder passes once a head was found somewhere in a photo
// A box that moved by a smaller fraction of its size is the same box.
constexpr float kSameBox = 0.15f;

// Prior of an unknown focal length: phones and portrait lenses have 0.7 to 2 times the long side.
constexpr double kFocalOfLongSide = 1.0, kLogFocalSigma = 0.35;

bool is_given(const std::array<float, 4>& box) {
  return std::any_of(box.begin(), box.end(), [](float side) { return side != 0; });
}

void check_hints(const ImageView& photo, const PhotoHints& hints) {
  const std::array<float, 4>& box = hints.box_px;
  const auto refuse = [&](const char* what) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The box of the head is (", box[0], ", ", box[1], ") to (", box[2], ", ",
                box[3], "), ", what, "; the photo has ", photo.width_px, " x ", photo.height_px,
                " pixels. Give left, top, right and bottom of the head, or zeros to have it found.");
  };
  if (is_given(box)) {
    if (!std::all_of(box.begin(), box.end(), [](float side) { return std::isfinite(side); }))
      refuse("which is not finite");
    if (!(box[2] > box[0]) || !(box[3] > box[1])) refuse("which is empty");
    if (box[2] <= 0 || box[3] <= 0 || box[0] >= float(photo.width_px) || box[1] >= float(photo.height_px)) {
      refuse("which is outside of the photo");
    }
  }
  if (!(std::abs(hints.roll_rad) <= 7)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The roll of the head is ", hints.roll_rad,
                ", but must be -7 to 7 radians; upright is 0.");
  }
  if (hints.focal_px != 0 && !(hints.focal_px >= 1e-3 && hints.focal_px <= 1e9)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The focal length is ", hints.focal_px,
                ", but must be 0.001 to 1e9 pixels, or 0 where it is not known.");
  }
}

bool shows_head(const HeadCell& cell) { return cell.is_usable && cell.matte > kMinMatte; }

// The box around the chosen cells, at least one, without strays.
template <typename IsChosen>
std::array<float, 4> box_of(const HeadObservations& seen, IsChosen is_chosen) {
  std::vector<double> x, y;
  for (const HeadCell& cell : seen.cells) {
    if (!is_chosen(cell)) continue;
    x.push_back(cell.x_px);
    y.push_back(cell.y_px);
  }
  const auto ends = [&](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    const size_t strays = size_t(kStrayFraction * double(values.size()));
    // Half a cell on each side, and pixels end half a pixel from their middle.
    return std::pair{float(values[strays] + 0.5 - seen.cell_px / 2),
                     float(values[values.size() - 1 - strays] + 0.5 + seen.cell_px / 2)};
  };
  const auto [left, right] = ends(x);
  const auto [top, bottom] = ends(y);
  return {left, top, right, bottom};
}

bool is_same(const std::array<float, 4>& a, const std::array<float, 4>& b) {
  const float limit = kSameBox * std::max(b[2] - b[0], b[3] - b[1]);
  for (size_t side = 0; side < 4; ++side) {
    if (std::abs(a[side] - b[side]) > limit) return false;
  }
  return true;
}

// The squares in which a head is searched: the middle, the whole photo, then squares of half the photo's short side
// that overlap by half, the middle ones first.
std::vector<HeadSquare> squares_to_search(int width_px, int height_px, double roll_rad) {
  const double width = width_px, height = height_px, short_side = std::min(width, height);
  std::vector<HeadSquare> squares;
  const auto add = [&](double x, double y, double side) { squares.push_back({x, y, std::max(2.0, side), roll_rad}); };
  add(width / 2, height / 2, short_side);
  if (width_px != height_px) add(width / 2, height / 2, std::max(width, height));
  const double side = short_side / 2;
  if (side < kMinSearchedSide_px) return squares;
  const int columns = std::min(kMaxSearchedSquares, int(2 * width / side) - 1);
  const int rows = std::min(kMaxSearchedSquares, int(2 * height / side) - 1);
  const size_t first = squares.size();
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      add(side / 2 + (width - side) * column / std::max(1, columns - 1),
          side / 2 + (height - side) * row / std::max(1, rows - 1), side);
    }
  }
  const auto from_middle = [&](const HeadSquare& square) {
    return std::hypot(square.x_px - width / 2, square.y_px - height / 2);
  };
  std::stable_sort(squares.begin() + std::ptrdiff_t(first), squares.end(),
                   [&](const HeadSquare& a, const HeadSquare& b) { return from_middle(a) < from_middle(b); });
  return squares;
}

[[noreturn]] void refuse_photos(const std::vector<PhotoFit>& photos) {
  throw Error(MAQ_ERROR_NOT_FOUND, photos.size() == 1 ? "The photo" : "None of the photos",
              photos.size() == 1 ? " does not show a head that can be fitted: " : " shows a head that can be fitted: ",
              pose_status_text(photos.front().status),
              " Use a photo where the face is seen, 64 pixels or more across, and give its box.");
}

}  // namespace

HeadBuilder::HeadBuilder(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, Bundle bundle,
                         const SessionSettings& settings, const TextureOptions& texture)
    : bundle_(std::move(bundle)), encoder_(runtime, bundle_, settings), cancel_(runtime), texture_(texture) {}

void HeadBuilder::add_photo(const ImageView& photo, const PhotoHints& hints) {
  check_hints(photo, hints);
  if (photos_.size() >= kMaxFitPhotos) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There are ", photos_.size(),
                " photos already, which is the most for one head; fit them, or clear them for another head.");
  }
  const Stopwatch watch;
  const size_t before = found_.size();
  try {
    cancel_.check();
    encode_photo(photo, hints);
    cancel_.check();  // one that comes later is of the next call
  } catch (...) {
    cancel_.reset();
    photos_.resize(before);
    found_.resize(before);
    if (crops_.size() > before) crops_.resize(before);
    throw;
  }
  stats_.encode_ms += watch.elapsed_ms();
}

void HeadBuilder::add_head(StoredHead head) {
  EarlierHead made(bundle_.prior, bundle_.prior_sha256, std::move(head));
  earlier_.emplace(std::move(made));
}

void HeadBuilder::clear() {
  earlier_.reset();
  photos_.clear();
  found_.clear();
  crops_.clear();
  encoding_ = {};
  stats_ = {};
}

HeadBuilder::EncodedCrop HeadBuilder::encode_crop(const ImageView& photo, const HeadSquare& square) {
  encoder_.run(photo, square, cancel_, encoding_);
  EncodedCrop seen;
  seen.square = square;
  seen.cells = read_observations(encoding_.cells.data(), encoder_.spec().cells, encoding_.crop_to_photo, photo.width_px,
                                 photo.height_px);
  seen.head_cells = size_t(std::count_if(seen.cells.cells.begin(), seen.cells.cells.end(), shows_head));
  std::vector<double> sigmas;
  for (const HeadCell& cell : seen.cells.cells) {
    if (shows_head(cell)) sigmas.push_back(cell.sigma_dm);
  }
  const auto middle = sigmas.begin() + std::ptrdiff_t(sigmas.size() / 2);
  std::nth_element(sigmas.begin(), middle, sigmas.end());
  seen.sigma_dm = sigmas.empty() ? 0 : *middle;
  return seen;
}

std::pair<std::array<float, 4>, HeadBuilder::EncodedCrop> HeadBuilder::find_head(const ImageView& photo,
                                                                                 double roll_rad) {
  for (const HeadSquare& square : squares_to_search(photo.width_px, photo.height_px, roll_rad)) {
    EncodedCrop seen = encode_crop(photo, square);
    std::array<float, 4> box{};
    for (int passes = 0; passes < kPassesAround && seen.head_cells >= kMinHeadCells; ++passes) {
      const std::array<float, 4> around = box_of(seen.cells, shows_head);
      if (std::max(around[2] - around[0], around[3] - around[1]) < kMinFoundSide_px) seen.head_cells = 0;
      if (seen.head_cells == 0 || (passes > 0 && is_same(around, box))) break;
      box = around;
      seen = encode_crop(photo, square_around(double(box[0]), double(box[1]), double(box[2]), double(box[3]), roll_rad,
                                              encoder_.spec()));
    }
    if (seen.head_cells >= kMinHeadCells && seen.sigma_dm <= kMaxFoundSigma_dm) return {box, std::move(seen)};
  }
  throw Error(MAQ_ERROR_NOT_FOUND, "No head is seen in the photo of ", photo.width_px, " x ", photo.height_px,
              " pixels. Give the box of the head, or a photo where it is larger.");
}

std::optional<HeadObservations> HeadBuilder::encode_face_crop(const ImageView& photo, const HeadObservations& seen,
                                                              double roll_rad) {
  const std::optional<FaceSpec>& face = encoder_.spec().face;
  if (!face) return std::nullopt;
  const auto shows_face = [&](const HeadCell& cell) { return shows_head(cell) && face->contains(cell.template_point); };
  if (size_t(std::count_if(seen.cells.begin(), seen.cells.end(), shows_face)) < kMinHeadCells) return std::nullopt;
  const std::array<float, 4> box = box_of(seen, shows_face);
  const double x0 = double(box[0]), y0 = double(box[1]), x1 = double(box[2]), y1 = double(box[3]);
  const double side_px = std::max(2.0, face->crop_sides * std::max(x1 - x0, y1 - y0));
  return encode_crop(photo, {(x0 + x1) / 2, (y0 + y1) / 2, side_px, roll_rad}).cells;
}

void HeadBuilder::encode_photo(const ImageView& photo, const PhotoHints& hints) {
  std::array<float, 4> box = hints.box_px;
  EncodedCrop seen;
  if (is_given(box)) {
    seen = encode_crop(photo, square_around(double(box[0]), double(box[1]), double(box[2]), double(box[3]),
                                            hints.roll_rad, encoder_.spec()));
    if (seen.head_cells < kMinHeadCells || seen.sigma_dm > kMaxSigma_dm) {
      throw Error(MAQ_ERROR_NOT_FOUND, "No head is seen in the box (", box[0], ", ", box[1], ") to (", box[2], ", ",
                  box[3], ") of the photo. Give the box of the head with its hair, and its roll where it leans.");
    }
  } else {
    std::tie(box, seen) = find_head(photo, hints.roll_rad);
  }
  const double long_side = std::max(photo.width_px, photo.height_px);
  HeadPhoto made;
  made.seen = std::move(seen.cells);
  made.width_px = photo.width_px, made.height_px = photo.height_px;
  made.focal_px = hints.focal_px > 0 ? hints.focal_px : kFocalOfLongSide * long_side;
  made.log_focal_sigma = hints.focal_px > 0 ? 0 : kLogFocalSigma;
  made.cx_px = (photo.width_px - 1) / 2.0, made.cy_px = (photo.height_px - 1) / 2.0;
  made.rgb_side = encoder_.spec().crop_px();
  made.rgb = encoding_.rgb;
  const double cells = double(made.seen.cells.size());
  made.face = encode_face_crop(photo, made.seen, hints.roll_rad);
  if (texture_.side_px > 0) crops_.push_back(texture_crop(photo, seen.square, texture_.side_px));
  photos_.push_back(std::move(made));
  found_.push_back({box, double(seen.head_cells) / cells, false, 0, 0});
}

StoredHead HeadBuilder::fit(double seconds, const Progress& progress) {
  if (!(seconds >= 0 && seconds <= 3600)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The time for the fit is ", seconds, " s, but must be 0 to 3600.");
  }
  if (photos_.empty()) throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There are no photos; add one before the fit.");
  for (PhotoFound& found : found_) found.is_used = false, found.focal_px = found.rms_px = 0;
  stats_ = {stats_.encode_ms};
  const Stopwatch watch;
  try {
    cancel_.check();
    StoredHead head = fit_photos(seconds, progress);
    cancel_.check();
    stats_.total_ms = watch.elapsed_ms();
    return head;
  } catch (...) {
    cancel_.reset();
    throw;
  }
}

void HeadBuilder::set_preview(double interval_s, Preview preview) {
  if (!(interval_s >= 0 && interval_s <= 3600)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The time between previews is ", interval_s, " s, but must be 0 to 3600.");
  }
  preview_interval_s_ = interval_s;
  preview_ = std::move(preview);
}

StoredHead HeadBuilder::stored_head(const FieldCodes& fitted, FieldWeights weights, const AnchorFit& start,
                                    const std::vector<PhotoFit>& photos) const {
  const HeadPrior& prior = bundle_.prior;
  StoredHead head(std::move(weights));
  head.codes = earlier_ ? earlier_->codes(fitted) : fitted;
  const std::vector<float> covariance = earlier_ ? earlier_->covariance(start.code_covariance) : start.code_covariance;
  head.code_factor = covariance_factor(covariance, head.codes.shape.size());
  if (earlier_) head.cameras = earlier_->head().cameras;
  for (const PhotoFit& photo : photos) {
    if (photo.is_used()) head.cameras.push_back(photo.camera);
  }
  head.scale.sigma = size_sigma(prior) * head.scale.metres_per_unit;
  head.sharpness = prior.sharpness;
  head.cut = prior.cut;
  head.bounds = prior.bounds;
  head.anchors = known_anchors(prior, head.codes.shape, covariance);
  if (earlier_) head.scale = earlier_->scale(head.scale, head.anchors);
  head.landmarks = prior.landmarks;
  head.prior_sha256 = bundle_.prior_sha256;
  return head;
}

StoredHead HeadBuilder::fit_photos(double seconds, const Progress& progress) {
  const auto report = [&](double done) {
    if (progress && !progress(done)) cancel_.cancel();
    cancel_.check();
  };
  report(0);
  const HeadPrior& prior = earlier_ ? earlier_->prior() : bundle_.prior;
  HeadFitOptions options;
  options.seconds = seconds;
  WorkerThreads threads(encoder_.threads());
  std::optional<double> next_preview_s;  // none before the first
  HeadFit fit = fit_head(prior, photos_, options, threads, [&](const HeadFitProgress& now) {
    if (preview_ && now.seconds >= next_preview_s.value_or(0)) {
      FieldWeights weights(prior.bases.shape());
      prior.bases.combine(now.codes, weights);
      preview_(stored_head(now.codes, std::move(weights), now.start, now.photos));
      next_preview_s = now.seconds + preview_interval_s_;
    }
    report(std::min(1.0, std::max(now.seconds / seconds, double(now.steps) / options.max_steps)));
    return true;
  });
  stats_.pose_ms = 1e3 * fit.stats.anchor_seconds;
  stats_.fit_ms = 1e3 * (fit.stats.seconds - fit.stats.anchor_seconds);
  stats_.steps = fit.stats.steps;
  stats_.used_photos = fit.start.used();
  if (!fit.start.is_found()) refuse_photos(fit.start.photos);

  for (size_t i = 0; i < photos_.size(); ++i) {
    const PhotoFit& photo = fit.photos[i];
    if (!photo.is_used()) continue;
    found_[i].is_used = true;
    found_[i].focal_px = photo.camera.focal_px;
    found_[i].rms_px = photo.rms_px;
  }
  StoredHead head = stored_head(fit.codes, std::move(fit.weights), fit.start, fit.photos);
  if (texture_.side_px > 0) {
    std::vector<TextureSource> sources;
    for (size_t i = 0; i < photos_.size(); ++i) {
      if (fit.photos[i].is_used()) sources.push_back({&crops_[i], &photos_[i].seen, fit.photos[i].camera});
    }
    head.texture =
        make_texture(head, sources, texture_, threads, earlier_ ? earlier_->head().texture : StoredTexture{});
  }
  report(1);
  return head;
}

}  // namespace maq::head
