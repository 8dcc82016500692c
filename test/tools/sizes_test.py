"""The check of sizes: where functions of C++ and Python begin and end."""
import sys
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools/lib"))
sys.dont_write_bytecode = True

from sizes.functions import cpp_functions, python_functions  # noqa: E402


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


class PythonFunctions(unittest.TestCase):
    def test_a_function_ends_with_its_last_statement(self):
        self.assertEqual(list(python_functions("def f():\n    def g():\n        pass\n    return g\n\nx = 1\n")),
                         [("f", 1, 4), ("g", 2, 3)])


if __name__ == "__main__":
    unittest.main()
