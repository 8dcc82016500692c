"""The check of sizes: where functions and classes of C++ and Python begin and end, and which are too long."""
import sys
import tempfile
import unittest
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools/lib"))
sys.dont_write_bytecode = True

from sizes.definitions import cpp_classes, cpp_functions, python_classes, python_functions  # noqa: E402


loader = SourceFileLoader("check_sizes", str(ROOT / "tools/check_sizes"))
check_sizes = module_from_spec(spec_from_loader(loader.name, loader))
loader.exec_module(check_sizes)


def found(text):
    return list(cpp_functions(text))


class CppFunctions(unittest.TestCase):
    def test_a_function_reaches_from_its_type_to_its_last_brace(self):
        self.assertEqual(found("int n;\n\nint\nf(int a) {\n  if (a) {\n  }\n}\n"), [("f", 3, 7)])

    def test_members_of_classes_in_namespaces_count(self):
        text = "namespace n {\nclass C : public B {\n public:\n  C() : a_{1}, b_(2) {}\n  int g() const {\n  }\n};\n}\n"
        self.assertIn(("g", 5, 6), found(text))

    def test_templates_and_operators_count(self):
        self.assertEqual(found("template <class T>\nbool C<T>::operator==(const C& o) const {\n}\n"), [("operator==", 1, 3)])

    def test_functions_in_functions_do_not_count(self):
        self.assertEqual(found("void f() {\n  auto g = [](int i) {\n    return i;\n  };\n}\n"), [("f", 1, 5)])

    def test_declarations_tables_and_defaults_are_no_functions(self):
        self.assertEqual(found("int f(A a = {});\nint table[] = {\n  1,\n};\nenum E { one };\nint g(A a = {}) {\n}\n"),
                         [("g", 6, 7)])

    def test_braces_in_literals_comments_and_macros_do_not_count(self):
        text = 'void f() {\n  // {\n  g("{", \'{\', R"({)", 1\'000);\n#define OPEN \\\n  {\n}\nvoid h() {}\n'
        self.assertEqual(found(text), [("f", 1, 6), ("h", 7, 7)])


def classes(text):
    return list(cpp_classes(text))


class CppClasses(unittest.TestCase):
    def test_a_class_reaches_from_its_template_to_its_last_brace(self):
        text = "int n;\ntemplate <class T>\nclass C final : public B<T> {\n  T t = {};\n};\n"
        self.assertEqual(classes(text), [("C", 2, 5)])

    def test_structs_unions_and_specialisations_count(self):
        text = "struct alignas(4) S {\n};\nunion U {\n};\ntemplate <>\nstruct Hash<S> {\n};\nstruct {\n  int i;\n} s;\n"
        self.assertEqual(classes(text), [("S", 1, 2), ("U", 3, 4), ("Hash", 5, 7), ("?", 8, 10)])

    def test_classes_in_classes_and_functions_count(self):
        text = "class A {\n public:\n  class B {\n  };\n};\nclass A::C {\n};\nvoid f() {\n  struct D {\n  };\n}\n"
        self.assertEqual(classes(text), [("B", 3, 4), ("A", 1, 5), ("A::C", 6, 7), ("D", 9, 10)])

    def test_enums_functions_and_values_are_no_classes(self):
        self.assertEqual(classes("enum class E {\n  one\n};\nstruct S* f(class C c) {\n}\nstruct S s = {\n};\n"), [])


class PythonDefinitions(unittest.TestCase):
    def test_a_class_ends_with_its_last_method(self):
        self.assertEqual(list(python_classes("class C:\n    def f(self):\n        pass\n\nx = 1\n")), [("C", 1, 3)])

    def test_a_function_ends_with_its_last_statement(self):
        self.assertEqual(list(python_functions("def f():\n    def g():\n        pass\n    return g\n\nx = 1\n")),
                         [("f", 1, 4), ("g", 2, 3)])


class CheckSizes(unittest.TestCase):
    def findings(self, text):
        with tempfile.TemporaryDirectory() as folder:
            check_sizes.ROOT = Path(folder)
            (check_sizes.ROOT / "a.h").write_text(text)
            return list(check_sizes.long_parts("a.h"))

    def test_the_limits_are_allowed(self):
        text = "class C {\n" + 238 * "\n" + "};\nvoid f() {\n" + 58 * "\n" + "}\n" + 100 * "\n"
        self.assertEqual(self.findings(text), [])

    def test_long_files_classes_and_functions_are_found(self):
        text = "class C {\n" + 239 * "\n" + "};\nvoid f() {\n" + 59 * "\n" + "}\n" + 99 * "\n"
        self.assertEqual([(place, line, message.split(";")[0]) for place, line, message in self.findings(text)],
                         [("a.h", 1, "401 lines"), ("a.h:C", 1, "C has 241 lines"), ("a.h:f", 242, "f has 61 lines")])


if __name__ == "__main__":
    unittest.main()
