#include "edges/files/curve_step.h"

#include <ostream>
#include <sstream>
#include <utility>

#include "edges/files/curve_text.h"

namespace maq {
namespace {

// A product whose shape is the wireframe; lengths are metres.
constexpr char kHead[] = R"(ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('Sharp feature curves'),'2;1');
FILE_NAME('edges','',(''),(''),'Maquette','Maquette','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
#1=APPLICATION_CONTEXT('automotive design');
#2=APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#1);
#3=PRODUCT_CONTEXT('',#1,'mechanical');
#4=PRODUCT('edges','edges','',(#3));
#5=PRODUCT_DEFINITION_FORMATION('','',#4);
#6=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#7=PRODUCT_DEFINITION('design','',#5,#6);
#8=PRODUCT_DEFINITION_SHAPE('','',#7);
#9=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));
#10=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#11=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#12=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-6),#9,'distance_accuracy_value','');
#13=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#12))
GLOBAL_UNIT_ASSIGNED_CONTEXT((#9,#10,#11))REPRESENTATION_CONTEXT('',''));
#14=CARTESIAN_POINT('',(0.,0.,0.));
#15=DIRECTION('',(0.,0.,1.));
#16=DIRECTION('',(1.,0.,0.));
#17=AXIS2_PLACEMENT_3D('',#14,#15,#16);
#18=GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION('edges',(#17,#19),#13);
#20=SHAPE_DEFINITION_REPRESENTATION(#8,#18);
#21=PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#4));
)";
constexpr int kOrigin = 14, kSet = 19, kLastOfHead = 21;

class StepWriter {
 public:
  StepWriter() {
    text_.setf(std::ios::showpoint | std::ios::uppercase);  // reals have a point, and E for their exponent
    text_ << kHead;
  }

  // Its number in the file.
  int add(const EdgeCurves& curves, const EdgeCurve& curve) {
    const std::string name = layer_of(curve);
    switch (curve.type) {
      case CurveType::kLine: return add_line(name, &curves.points[size_t(curve.first_point)]);
      case CurveType::kArc: return add_arc(name, curve);
      case CurveType::kSpline: break;
    }
    return add_spline(name, &curves.controls[size_t(curve.first_control)], curve.control_count);
  }

  std::string finish(const std::vector<int>& set) {
    text_ << '#' << kSet << "=GEOMETRIC_CURVE_SET('',";
    put_list(set);
    text_ << ");\nENDSEC;\nEND-ISO-10303-21;\n";
    return text_.str();
  }

 private:
  std::ostream& begin() { return text_ << '#' << ++last_ << '='; }

  void put_list(const std::vector<int>& numbers) {
    const char* before = "";
    text_ << '(';
    for (const int number : numbers) text_ << std::exchange(before, ",") << '#' << number;
    text_ << ')';
  }

  int add_triple(const char* what, Vec3 p) {
    begin() << what << "('',(" << p.x << ',' << p.y << ',' << p.z << "));\n";
    return last_;
  }
  int add_point(Vec3 p) { return add_triple("CARTESIAN_POINT", p); }
  int add_direction(Vec3 d) { return add_triple("DIRECTION", normalized(d)); }

  int add_trimmed(const std::string& name, int curve, double to) {
    begin() << "TRIMMED_CURVE('" << name << "',#" << curve << ",(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(" << to
            << ")),.T.,.PARAMETER.);\n";
    return last_;
  }

  int add_line(const std::string& name, const Vec3* ends) {
    const int point = add_point(ends[0]), direction = add_direction(ends[1] - ends[0]);
    begin() << "VECTOR('',#" << direction << ",1.);\n";
    const int vector = last_;
    begin() << "LINE('',#" << point << ",#" << vector << ");\n";
    return add_trimmed(name, last_, length(ends[1] - ends[0]));
  }

  int add_arc(const std::string& name, const EdgeCurve& arc) {
    const int centre = add_point(arc.centre), axis = add_direction(cross(arc.x_axis, arc.y_axis)),
              start = add_direction(arc.x_axis);
    begin() << "AXIS2_PLACEMENT_3D('',#" << centre << ",#" << axis << ",#" << start << ");\n";
    const int placement = last_;
    begin() << "CIRCLE('" << (arc.is_closed ? name : "") << "',#" << placement << ',' << length(arc.x_axis) << ");\n";
    return arc.is_closed ? last_ : add_trimmed(name, last_, arc.sweep_rad);
  }

  // Its knots are even: single knots between the ends, four at each end.
  int add_spline(const std::string& name, const Vec3* controls, int count) {
    std::vector<int> points;
    for (int i = 0; i < count; ++i) points.push_back(add_point(controls[i]));
    begin() << "B_SPLINE_CURVE_WITH_KNOTS('" << name << "',3,";
    put_list(points);
    text_ << ",.UNSPECIFIED.,.F.,.F.,(4";
    const int spans = count - 3;
    for (int i = 1; i < spans; ++i) text_ << ",1";
    text_ << ",4),(0.";
    for (int i = 1; i <= spans; ++i) text_ << ',' << i << '.';
    text_ << "),.UNSPECIFIED.);\n";
    return last_;
  }

  std::ostringstream text_ = text_of_numbers();
  int last_ = kLastOfHead;
};

}  // namespace

std::string curves_as_step(const EdgeCurves& curves) {
  StepWriter writer;
  std::vector<int> set;
  for (const EdgeCurve& curve : curves.curves) set.push_back(writer.add(curves, curve));
  if (set.empty()) set.push_back(kOrigin);  // a set has to have something in it
  return writer.finish(set);
}

}  // namespace maq
