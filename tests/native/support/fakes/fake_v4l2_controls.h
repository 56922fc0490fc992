// The controls of FakeV4l2, as the kernel answers for a driver.
#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <set>

class FakeV4l2Controls {
 public:
  struct Control {
    int minimum, maximum, step, preset;
    uint32_t flags = 0;
    std::set<uint32_t> items = {};  // of a menu
    int value = preset;
  };
  std::map<uint32_t, Control> all;

  // 0 or an error number.
  int query(v4l2_queryctrl& asked) const {
    const auto found = all.find(asked.id);
    if (found == all.end()) return EINVAL;
    const Control& control = found->second;
    asked.minimum = control.minimum;
    asked.maximum = control.maximum;
    asked.step = control.step;
    asked.default_value = control.preset;
    asked.flags = control.flags;
    return 0;
  }
  int query_item(const v4l2_querymenu& asked) const {
    const auto found = all.find(asked.id);
    return found != all.end() && found->second.items.count(asked.index) != 0 ? 0 : EINVAL;
  }
  int get(v4l2_control& asked) const {
    const auto found = all.find(asked.id);
    if (found == all.end()) return EINVAL;
    asked.value = found->second.value;
    return 0;
  }
  int set(const v4l2_control& wanted) {
    const auto found = all.find(wanted.id);
    if (found == all.end()) return EINVAL;
    Control& control = found->second;
    if ((control.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) return EACCES;
    if (!control.items.empty() && control.items.count(uint32_t(wanted.value)) == 0) return EINVAL;
    control.value = std::clamp(wanted.value, control.minimum, control.maximum);
    return 0;
  }
};
