#include "body/files/body_bvh.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>

#include "body/files/file_axes.h"

namespace maq::body {
namespace {

constexpr double kCentimetres = 100, kDegreesInRadian = 57.29577951308232, kDefaultFrame_s = 1.0 / 30;
constexpr char kRotations[] = "Zrotation Xrotation Yrotation";

// Angles about z, x and y of a rotation Rz Rx Ry, degrees.
Vec3 angles_of(const Mat3& r) {
  const double sine = std::clamp(r[7], -1.0, 1.0);
  if (std::abs(sine) > 1 - 1e-12) {  // z and y turn about one axis: all of it to z
    return {kDegreesInRadian * std::atan2(r[3], r[0]), kDegreesInRadian * std::asin(sine), 0};
  }
  return {kDegreesInRadian * std::atan2(-r[1], r[4]), kDegreesInRadian * std::asin(sine),
          kDegreesInRadian * std::atan2(-r[6], r[8])};
}

class BvhText {
 public:
  BvhText(const BodyModel& model, const ClipPerson& person) : model_(model), person_(person), shape_(person.shape()) {
    text_.imbue(std::locale::classic());
    text_ << std::fixed << std::setprecision(4);
    for (const BodyJoint& joint : model.joints) {
      rest_.push_back(shaped(joint.rest, joint.basis, shape_, model.shape_count));
    }
  }

  std::string write() {
    text_ << "HIERARCHY\n";
    write_joint(0, 0);
    const size_t count = person_.poses.size();
    const double frame_s = count > 1 ? person_.length_s() / double(count - 1) : kDefaultFrame_s;
    text_ << "MOTION\nFrames: " << count << "\nFrame Time: " << std::setprecision(8) << frame_s << std::setprecision(4)
          << '\n';
    size_t before = 0;
    for (size_t frame = 0; frame < count; ++frame) {
      const double at_ns = double(person_.poses.front().timestamp_ns) + 1e9 * frame_s * double(frame);
      while (before + 2 < count && double(person_.poses[before + 1].timestamp_ns) <= at_ns) ++before;
      write_frame(before, at_ns);
    }
    return text_.str();
  }

 private:
  void write_vector(Vec3 v) { text_ << v.x + 0.0 << ' ' << v.y + 0.0 << ' ' << v.z + 0.0; }

  void write_offset(const std::string& margin, Vec3 from, Vec3 to) {
    text_ << margin << "OFFSET ";
    write_vector(kCentimetres * (kBodyToFile * (to - from)));
    text_ << '\n';
  }

  // The vertex that the joint moves alone and that is farthest from it: the end of a limb.
  Vec3 end_of(size_t joint) const {
    Vec3 end = rest_[joint];
    for (const BodyPoint& point : model_.vertices) {
      if (point.joints[0] != joint || point.weights[0] < 0.9) continue;
      const Vec3 at = shaped(point.rest, point.basis, shape_, model_.shape_count);
      if (length(at - rest_[joint]) > length(end - rest_[joint])) end = at;
    }
    return end;
  }

  // Channels are in the order in which the joints appear.
  void write_joint(size_t joint, size_t depth) {
    const std::string margin(2 * depth, ' '), inner(2 * depth + 2, ' ');
    const int parent = model_.joints[joint].parent;
    text_ << margin << (parent < 0 ? "ROOT " : "JOINT ") << model_.joints[joint].name << '\n' << margin << "{\n";
    write_offset(inner, parent < 0 ? rest_[0] : rest_[size_t(parent)], rest_[joint]);
    text_ << inner << (parent < 0 ? "CHANNELS 6 Xposition Yposition Zposition " : "CHANNELS 3 ") << kRotations << '\n';
    order_.push_back(joint);
    bool has_children = false;
    for (size_t j = joint + 1; j < model_.joints.size(); ++j) {
      if (model_.joints[j].parent != int(joint)) continue;
      has_children = true;
      write_joint(j, depth + 1);
    }
    if (!has_children) {
      text_ << inner << "End Site\n" << inner << "{\n";
      write_offset(inner + "  ", rest_[joint], end_of(joint));
      text_ << inner << "}\n";
    }
    text_ << margin << "}\n";
  }

  static Mat3 rotation(size_t joint, const BodyPose& pose) {
    return joint == 0 ? orientation_in_file(pose.orientation) : local_in_file(exp_rotation(pose.rotation[joint]));
  }

  void write_frame(size_t before, double at_ns) {
    const ClipPose &a = person_.poses[before], &b = person_.poses[std::min(before + 1, person_.poses.size() - 1)];
    const double span = double(b.timestamp_ns - a.timestamp_ns);
    const double fraction = span > 0 ? std::clamp((at_ns - double(a.timestamp_ns)) / span, 0.0, 1.0) : 0;
    write_vector(kCentimetres * (kCameraToFile * (a.pose.place + fraction * (b.pose.place - a.pose.place))));
    for (const size_t joint : order_) {
      const Mat3 from = rotation(joint, a.pose), to = rotation(joint, b.pose);
      text_ << ' ';
      write_vector(angles_of(from * exp_rotation(fraction * log_rotation(transposed(from) * to))));
    }
    text_ << '\n';
  }

  const BodyModel& model_;
  const ClipPerson& person_;
  const std::array<double, kMaxShapes> shape_;
  std::vector<Vec3> rest_;
  std::vector<size_t> order_;
  std::ostringstream text_;
};

}  // namespace

std::string person_as_bvh(const BodyModel& model, const ClipPerson& person) { return BvhText(model, person).write(); }

}  // namespace maq::body
