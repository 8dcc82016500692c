// A user's program that compiles a pipeline to files in <folder>.
#include <retrograde/retrograde.h>

#include <string>

using namespace retrograde;

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  ImageParam in(Float(32), 2, "in");
  Param<float> gamma("gamma", 2.2f);
  Var x("x"), y("y");
  Func curve("curve");
  curve(x, y) = pow(in(x, y), 1.0f / gamma);
  curve.vectorize(x, 8).parallel(y);
  curve.compile_to_file(std::string(argv[1]) + "/curve", {in, gamma}, "curve",
                        get_host_target().with_feature(Target::NoRuntime));
  return 0;
}
