#include "sources/control_options.h"

#include <algorithm>
#include <optional>

#include "core/error.h"

namespace maq {
namespace {

struct Option {
  const char* key;
  maq_source_control manual;
  std::optional<maq_source_control> automatic;
};
// The automatic exposure of most devices chooses the gain as well.
const Option kOptions[] = {{"exposure", MAQ_SOURCE_CONTROL_EXPOSURE, MAQ_SOURCE_CONTROL_AUTO_EXPOSURE},
                           {"gain", MAQ_SOURCE_CONTROL_GAIN, MAQ_SOURCE_CONTROL_AUTO_EXPOSURE},
                           {"focus", MAQ_SOURCE_CONTROL_FOCUS, MAQ_SOURCE_CONTROL_AUTO_FOCUS},
                           {"white_balance", MAQ_SOURCE_CONTROL_WHITE_BALANCE, MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE},
                           {"brightness", MAQ_SOURCE_CONTROL_BRIGHTNESS, {}}};

}  // namespace

std::vector<ControlSetting> take_control_options(SourceUri& uri) {
  std::vector<ControlSetting> settings;
  for (const Option& option : kOptions) {
    if (uri.options.count(option.key) == 0) continue;
    const std::string text = uri.take_text(option.key);
    if (text == "auto" && option.automatic) {
      settings.push_back({*option.automatic, 1});
    } else if (const auto number = read_number(text)) {
      settings.push_back({option.manual, *number});
    } else {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, option.key, "=", text, " in ", uri.text, " must be a number",
                  option.automatic ? " or auto." : ".");
    }
  }
  const auto sets = [&](maq_source_control which) {
    return std::any_of(settings.begin(), settings.end(), [&](const auto& setting) { return setting.which == which; });
  };
  if (sets(MAQ_SOURCE_CONTROL_EXPOSURE) && sets(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "gain=auto in ", uri.text,
                " leaves the exposure to the device as well; give the gain as a number, or exposure=auto.");
  }
  return settings;
}

}  // namespace maq
