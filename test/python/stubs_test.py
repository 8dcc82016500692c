"""Type stubs: valid Python that names what the module has, and no type that nobody knows."""
import ast
import builtins
import unittest
from pathlib import Path

import retrograde as rg
from retrograde import _retrograde

PACKAGE = Path(rg.__file__).parent


class Stubs(unittest.TestCase):
    def setUp(self):
        self.tree = ast.parse((PACKAGE / "_retrograde.pyi").read_text())
        self.classes = {c.name: c for c in self.tree.body if isinstance(c, ast.ClassDef)}

    def declared(self, body):
        names = set()
        for node in body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                names.add(node.name)
            elif isinstance(node, ast.AnnAssign):
                names.add(node.target.id)
            elif isinstance(node, ast.Assign):
                names |= {t.id for t in node.targets}
            elif isinstance(node, ast.ImportFrom):
                names |= {a.asname or a.name for a in node.names}
        return names

    def test_name_what_the_module_has(self):
        declared = self.declared(self.tree.body)
        self.assertEqual({n for n in dir(_retrograde) if not n.startswith("__")} - declared, set())
        for cls in ("Func", "Buffer", "Expr", "Pipeline", "GradientReport"):
            public = {n for n in vars(getattr(rg, cls)) if not n.startswith("_")}
            self.assertEqual(public - self.declared(self.classes[cls].body), set())

    def test_know_every_type(self):
        known = self.declared(self.tree.body) | set(dir(builtins)) | {"typing"}
        for function in [n for n in ast.walk(self.tree) if isinstance(n, ast.FunctionDef)]:
            for annotation in [function.returns] + [a.annotation for a in function.args.args if a.annotation]:
                used = {n.id for n in ast.walk(annotation) if isinstance(n, ast.Name)}
                self.assertEqual(used - known, set(), function.name)

    def test_say_what_is_meant(self):
        methods = {m.name: m for m in self.classes["Func"].body if isinstance(m, ast.FunctionDef)}
        self.assertIn("vectorize", methods)
        split = methods["split"]
        self.assertEqual([a.arg for a in split.args.args], ["self", "old", "outer", "inner", "factor", "tail"])
        self.assertEqual(ast.unparse(split.args.args[4].annotation), "ExprLike")
        self.assertEqual(ast.unparse(split.returns), "Func")
        self.assertIn("for", ast.get_docstring(split))
        any_function = sum(ast.unparse(f.args).startswith("*args") for f in self.tree.body if isinstance(f, ast.FunctionDef))
        self.assertLess(any_function, 25)  # those of any number of arguments

    def test_of_the_package(self):
        ast.parse((PACKAGE / "__init__.pyi").read_text())
        self.assertTrue((PACKAGE / "py.typed").exists())


if __name__ == "__main__":
    unittest.main()
