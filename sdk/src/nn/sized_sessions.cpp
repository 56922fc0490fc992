#include "nn/sized_sessions.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

namespace maq {
namespace {

// Returns the value of "height", "width", or one of them "/2", "/4", … for the image; nothing for other names.
std::optional<int64_t> size_of(const std::string& name, int width_px, int height_px) {
  const size_t slash = name.find('/');
  const std::string side = name.substr(0, slash);
  if (side != "width" && side != "height") return {};
  const long divisor = slash == std::string::npos ? 1 : std::strtol(name.c_str() + slash + 1, nullptr, 10);
  const int64_t whole = side == "width" ? width_px : height_px;
  if (divisor < 1 || whole % divisor != 0) return {};
  return whole / divisor;
}

}  // namespace

SizedSessions::SizedSessions(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const std::vector<uint8_t>& bytes,
                             GraphSpec spec, std::string name, SessionSettings settings, size_t max_kept)
    : runtime_(std::move(runtime)),
      bytes_(bytes),
      spec_(std::move(spec)),
      name_(std::move(name)),
      settings_(std::move(settings)),
      max_kept_(max_kept) {}

Session& SizedSessions::at(int width_px, int height_px) {
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) {
    return kept.width_px == width_px && kept.height_px == height_px;
  });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return *kept_.front().session;
  }
  // Before the new one is made: its memory is the larger part.
  while (!kept_.empty() && kept_.size() >= max_kept_) kept_.pop_back();
  SessionSettings settings = settings_;
  for (const TensorSpec& input : spec_.inputs) {
    for (const Dimension& dimension : input.shape) {
      const std::string* name = std::get_if<std::string>(&dimension);
      if (name == nullptr) continue;
      if (const auto size = size_of(*name, width_px, height_px)) settings.fixed_sizes.emplace_back(*name, *size);
    }
  }
  kept_.push_front({width_px, height_px, open_session(runtime_, bytes_, spec_, name_, settings)});
  return *kept_.front().session;
}

}  // namespace maq
