// From photos to a head: the encoder runs on each; cameras and codes are estimated, then fitted to the pixels.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/worker_threads.h"
#include "head/bundle/head_bundle.h"
#include "head/bundle/head_encoder.h"
#include "head/fit/head_fit.h"
#include "head/fit/observations.h"
#include "head/reconstruction/earlier_head.h"
#include "head/reconstruction/head_texture.h"
#include "head/stored_head.h"
#include "nn/session.h"

namespace maq::head {

// The fields of maq_head_photo.
struct PhotoHints {
  std::array<float, 4> box_px{};
  double roll_rad = 0;
  double focal_px = 0;
};

// The fields of maq_head_photo_info.
struct PhotoFound {
  std::array<float, 4> box_px{};
  double head_coverage = 0;
  bool is_used = false;
  double focal_px = 0, rms_px = 0;
};

struct HeadBuildStats {
  double encode_ms = 0;  // over all photos
  double pose_ms = 0, fit_ms = 0, total_ms = 0;
  int steps = 0;
  size_t used_photos = 0;
};

class HeadBuilder {
 public:
  // `texture`: heads get one, unless its side is 0. Throws the errors of HeadBundle and HeadEncoder.
  HeadBuilder(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, Bundle bundle, const SessionSettings& settings,
              const TextureOptions& texture = {0});
  HeadBuilder(const HeadBuilder&) = delete;
  HeadBuilder& operator=(const HeadBuilder&) = delete;

  // On failure nothing changes. Throws MAQ_ERROR_INVALID_ARGUMENT for hints that no photo of that size can have, and
  // for more than kMaxFitPhotos; MAQ_ERROR_NOT_FOUND if no head is visible, and the errors of HeadEncoder::run().
  void add_photo(const ImageView& photo, const PhotoHints& hints);
  // Uses a head of the same person as prior; it replaces an earlier one. On failure nothing changes. Throws the errors
  // of EarlierHead.
  void add_head(StoredHead head);
  // Forgets the photos and the prior head.
  void clear();
  size_t photo_count() const { return photos_.size(); }
  const PhotoFound& found(size_t index) const { return found_[index]; }
  const HeadBuildStats& stats() const { return stats_; }

  // Gets the finished fraction; returns false to cancel.
  using Progress = std::function<bool(double done)>;
  // Throws MAQ_ERROR_INVALID_ARGUMENT without photos, MAQ_ERROR_NOT_FOUND where no photo shows a head, MAQ_CANCELLED.
  StoredHead fit(double seconds, const Progress& progress);

  // Gets the head so far: first the encoder's, then every `interval_s` of a fit, which waits. Empty: no previews.
  // Throws MAQ_ERROR_INVALID_ARGUMENT for an interval that is not 0 to 3600 s.
  using Preview = std::function<void(StoredHead head)>;
  void set_preview(double interval_s, Preview preview);

  // From any thread: ends the running call, or else the next one.
  void cancel() noexcept { cancel_.cancel(); }

  // The template of the bundle; null if the bundle has none.
  const std::shared_ptr<const HeadTemplate>& template_head() const { return bundle_.template_head; }
  int threads() const { return encoder_.threads(); }
  maq_provider provider() const { return encoder_.provider(); }

 private:
  struct EncodedCrop {
    HeadSquare square;
    HeadObservations cells;
    size_t head_cells = 0;  // cells that show the head, by the matte
    double sigma_dm = 0;    // median of the encoder's sigmas of these cells
  };
  void encode_photo(const ImageView& photo, const PhotoHints& hints);
  EncodedCrop encode_crop(const ImageView& photo, const HeadSquare& square);
  // A second encoder pass on the face, if one is visible and the bundle supports it.
  std::optional<HeadObservations> encode_face_crop(const ImageView& photo, const HeadObservations& seen,
                                                   double roll_rad);
  // Detects the head in a photo without a box. Throws MAQ_ERROR_NOT_FOUND.
  std::pair<std::array<float, 4>, EncodedCrop> find_head(const ImageView& photo, double roll_rad);
  StoredHead fit_photos(double seconds, const Progress& progress);
  StoredHead stored_head(const FieldCodes& fitted, FieldWeights weights, const AnchorFit& start,
                         const std::vector<PhotoFit>& photos) const;

  HeadBundle bundle_;
  HeadEncoder encoder_;
  RunCancel cancel_;
  HeadEncoding encoding_;
  std::optional<EarlierHead> earlier_;
  std::vector<HeadPhoto> photos_;
  std::vector<PhotoFound> found_;
  TextureOptions texture_;
  std::vector<TextureCrop> crops_;  // one a photo, if heads get a texture
  HeadBuildStats stats_;
  double preview_interval_s_ = 0;
  Preview preview_;
};

}  // namespace maq::head
