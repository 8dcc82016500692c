"""Generators: classes that build a pipeline for given parameters and targets.

    @rg.generator(name="brighten")
    class Brighten:
        gain = rg.GeneratorParam(2.0)
        input = rg.InputBuffer("float32", 2)
        offset = rg.InputScalar("float32")
        output = rg.OutputBuffer("float32", 2)

        def generate(self):
            x, y = rg.Var("x"), rg.Var("y")
            self.output[x, y] = self.input[x, y] * self.gain + self.offset
            self.output.vectorize(x, self.natural_vector_size("float32"))

    Brighten(gain=3.0).realize([640, 480])      # in process; set the inputs, which are ImageParams and Params, first
    Brighten.call(photo_func, 1.0)              # inside another pipeline
    if __name__ == "__main__":
        rg.main()                               # python brighten.py -g brighten -o . target=host gain=3.0

In an instance, an input is an ImageParam or a Param, and an output is a Func; arrays (`count=3`) are lists. Types and
dimensions that a class leaves open are set by the parameters `input.type` and `input.dim`, or in `configure(self)`.
"""
import copy
import enum

from . import _retrograde as rg
from ._errors import CompileError, error

__all__ = ["Generator", "GeneratorParam", "InputBuffer", "InputScalar", "OutputBuffer", "OutputScalar",
           "alias", "create_callable_from_generator", "generator", "generators"]

generators = {}  # the classes that @generator registered, by name


# ---- declarations ----

class GeneratorParam:
    """A compile-time parameter with the type of its default: a bool, number, str, Type, Target or enumerator."""

    def __init__(self, default, *, min=None, max=None, choices=None):
        self.default, self.min, self.max, self.choices = default, min, max, choices

    def read(self, name, value):
        """The value of this parameter from `value`, which may be text; raises CompileError if it is not allowed."""
        asked = f'give the generator param "{name}" the value {value!r}'
        try:
            read = self._read(value)
        except (ValueError, KeyError, TypeError) as problem:
            kind = type(self.default).__name__
            raise error(CompileError, asked, f"it is a value of type {kind}", f"it is not: {problem}",
                        f"Write it as {self.default!r} is written") from None
        below, above = self.min is not None and read < self.min, self.max is not None and read > self.max
        if below or above:
            raise error(CompileError, asked, "it lies between its limits", f"they are {self.min} and {self.max}",
                        "Give a value between them")
        if self.choices is not None and read not in self.choices:
            raise error(CompileError, asked, "it is one of its choices", f"they are {list(self.choices)}", "Choose one")
        return read

    def _read(self, value):
        of = type(self.default)
        if isinstance(value, of) and not (of is int and isinstance(value, bool)):
            return value
        if of is bool:
            return {"true": True, "false": False}[str(value).lower()]
        if isinstance(self.default, enum.Enum):
            return of[value]
        if hasattr(of, "__members__"):
            return of.__members__[value]
        return of(value)


class _Port:
    """The declaration of an input or output."""

    def __init__(self, type=None, dimensions=None, *, count=None):
        self.types = None if type is None else self._types(type)
        self.dimensions, self.count = dimensions, count

    @staticmethod
    def _types(type):
        """A list of Types from one type or several, which may be Python's bool, int and float."""
        own = {bool: "bool", int: "int32", float: "float32"}
        return [rg.Type(own.get(t, t)) for t in (type if isinstance(type, (list, tuple)) else [type])]

    def make(self, name):
        if self.types is None or self.dimensions is None:
            missing = "type" if self.types is None else "dimensions"
            raise error(CompileError, f'make the {self.role} "{name}"', "every input and output has a type and dimensions",
                        f"its {missing} is open", f"Declare it, set it in configure(), or give {name}.type or {name}.dim")
        if self.count is None:
            return self.make_one(name)
        return [self.make_one(f"{name}_{i}") for i in range(self.count)]


class InputBuffer(_Port):
    """An input image; in an instance it is an ImageParam."""

    role = "input"

    def make_one(self, name):
        return rg.ImageParam(self.types[0], self.dimensions, name)


class InputScalar(_Port):
    """An input number; in an instance it is a Param. `value`, `min` and `max` are those of Param."""

    role = "input"

    def __init__(self, type=None, value=None, *, min=None, max=None, count=None):
        super().__init__(type, 0, count=count)
        self.limits = {"value": value, "min": min, "max": max}

    def make_one(self, name):
        return rg.Param(self.types[0], name, **self.limits)


class OutputBuffer(_Port):
    """An output; in an instance it is a Func. Several types declare a Tuple."""

    role = "output"

    def make_one(self, name):
        return rg.Func(self.types, self.dimensions, name)


class OutputScalar(OutputBuffer):
    """An output without dimensions."""

    def __init__(self, type=None, *, count=None):
        super().__init__(type, 0, count=count)


# ---- the base of all generators ----

def _listed(value):
    return value if isinstance(value, list) else [value]


class Generator:
    """Base of generators; @generator adds it to classes without it."""

    _name = ""

    def __init__(self, target=None, **params):
        self._target = rg.Target(target) if isinstance(target, str) else target or rg.get_jit_target_from_environment()
        self._auto_schedule, self._machine_params = False, rg.MachineParams()
        self._autoscheduler = rg.AutoschedulerParams()
        self._ports = {k: copy.copy(v) for k, v in self._declared(_Port)}
        self._params = dict(self._declared(GeneratorParam))
        for name, param in self._params.items():
            setattr(self, name, param.default)
        for name, value in params.items():
            self._set(name, value)
        self._pipeline, self._given, self._requirements, self._traced = None, {}, [], False
        self.configure()

    @classmethod
    def _declared(cls, kind):
        found = {}
        for base in reversed(cls.__mro__):
            found.update((k, v) for k, v in vars(base).items() if isinstance(v, kind))
        return list(found.items())

    def _set(self, name, value):
        port, _, what = name.partition(".")
        if name in self._params:
            setattr(self, name, self._params[name].read(name, value))
        elif name in ("auto_schedule", "machine_params", "autoscheduler") or port == "autoscheduler":
            self._set_schedule(name, value)
        elif port in self._ports and what in ("type", "dim", "size"):
            self._set_port(self._ports[port], what, value)
        else:
            names = list(self._params) + ["auto_schedule", "machine_params"]
            raise error(CompileError, f'give the generator "{self.name()}" the param "{name}"',
                        "a param is one of the generator's", f"it has {', '.join(names)}", "Choose one of them")

    def _set_schedule(self, name, value):
        if name == "autoscheduler":
            self._autoscheduler.name = str(value)
        elif name.startswith("autoscheduler."):
            self._autoscheduler.extra = {**self._autoscheduler.extra, name.partition(".")[2]: str(value)}
        elif name == "auto_schedule":
            self._auto_schedule = GeneratorParam(False).read(name, value)
        else:
            self._machine_params = rg.MachineParams(value) if isinstance(value, str) else value

    @staticmethod
    def _set_port(port, what, value):
        if what == "type":
            port.types = port._types(value.split(",") if isinstance(value, str) else value)
        elif what == "dim":
            port.dimensions = int(value)
        else:
            port.count = int(value)

    # ---- methods that generators override, and declarations ----

    def configure(self):
        """Called first: may add inputs and outputs, and set types and dimensions that the class leaves open."""

    def generate(self):
        """Defines and schedules the outputs."""
        raise NotImplementedError(f"{type(self).__name__} has no generate()")

    def add_input(self, name, port):
        self._ports[name] = port

    add_output = add_input

    def port(self, name):
        """The declaration of an input or output, for configure()."""
        return self._ports[name]

    # ---- methods for use in generate() ----

    def name(self):
        return self._name

    def target(self):
        return self._target

    def using_autoscheduler(self):
        return self._auto_schedule or bool(self._autoscheduler.name)

    def machine_params(self):
        return self._machine_params

    def natural_vector_size(self, type):
        return self._target.natural_vector_size(rg.Type(type))

    def add_requirement(self, condition, *message):
        """Adds a requirement to the pipeline once it is generated; see Pipeline.add_requirement."""
        self._requirements.append((condition, *message))

    def trace_pipeline(self):
        """Reports the begin and end of each call to the trace handler."""
        self._traced = True

    # ---- results ----

    def inputs(self):
        """The ImageParams and Params in the order of declaration."""
        return self._made("input")

    def outputs(self):
        """The output Funcs in the order of declaration."""
        return self._made("output")

    def _made(self, role):
        self.pipeline()
        return [one for name, port in self._ports.items() if port.role == role for one in _listed(getattr(self, name))]

    def pipeline(self):
        """The Pipeline of the outputs; the first call generates it."""
        if self._pipeline is None:
            for name, port in self._ports.items():
                setattr(self, name, self._given[name] if name in self._given else port.make(name))
            self._pipeline = ()  # allows generate() to call inputs() and outputs()
            self.generate()
            self._pipeline = rg.Pipeline(self._made("output"))
            for requirement in self._requirements:
                self._pipeline.add_requirement(*requirement)
            if self._traced:
                self._pipeline.trace_pipeline()
            if self._autoscheduler.name and not self._given:
                self._pipeline.apply_autoscheduler(self._target, self._autoscheduler)
            elif self._auto_schedule and not self._given:
                self._pipeline.auto_schedule(self._target, self._machine_params)
        return self._pipeline

    def realize(self, *args, **named):
        return self.pipeline().realize(*args, **named)

    def compile_to_callable(self):
        """A function that takes the inputs, then the outputs."""
        return self.pipeline().compile_to_callable(self.inputs(), self._target)

    def build_module(self, function_name=""):
        module = self.pipeline().compile_to_module(self.inputs(), function_name or self.name(), self._target)
        for output in self.outputs():
            module.remap_metadata_name(output.name(), _plain(output))
        return module

    def build_gradient_module(self, function_name=""):
        """A module with the gradient. Its function takes the inputs and, for each output y, `_grad_loss_for_y`, the
        gradient of a loss with respect to y. It computes `_grad_loss_y_wrt_a` for every output y and image a."""
        images = [i for i in self.inputs() if isinstance(i, rg.ImageParam)]
        seeds, gradients, names = [], [], {}
        for output in self.outputs():
            seed = rg.ImageParam(output.type(), output.dimensions(), "_grad_loss_for_" + _plain(output))
            bounds = [(seed.dim(d).min(), seed.dim(d).extent()) for d in range(seed.dimensions())]
            derivative = rg.propagate_adjoints(output, rg.Func(seed), bounds, rg.AdjointOptions(wrt=images))
            seeds.append(seed)
            for image in images:
                gradient = rg.Func("gradient")
                gradient[...] = derivative(image)[...]
                gradients.append(gradient)
                names[gradient.name()] = f"_grad_loss_{_plain(output)}_wrt_{image.name()}"
        module = rg.Pipeline(gradients).compile_to_module(self.inputs() + seeds, function_name or self.name() + "_grad",
                                                          self._target)
        for func, name in names.items():
            module.remap_metadata_name(func, name)
        return module

    @classmethod
    def call(cls, *inputs, target=None, **params):
        """The output Funcs, one or a tuple, for inputs that are Funcs, images, arrays or Exprs of a larger pipeline.
        Generator parameters go into a dict: `generator_params={"gain": 3.0}`."""
        made = cls(target, **params.pop("generator_params", {}))
        names = [name for name, port in made._ports.items() if port.role == "input"]
        given = dict(zip(names, inputs))
        for name in given.keys() & params.keys():
            raise TypeError(f"{made.name()} was given {name} twice")
        given.update(params)
        if len(inputs) > len(names) or set(given) != set(names):
            raise TypeError(f"{made.name()} takes {', '.join(names)}")
        made._given = {name: _input(made._ports[name], value) for name, value in given.items()}
        outputs = made.outputs()
        return outputs[0] if len(outputs) == 1 else tuple(outputs)

    def __repr__(self):
        return f'<retrograde.Generator "{self.name()}">'


def _input(port, value):
    if isinstance(value, (list, tuple)) and port.count is not None:
        return [_input(copy.copy(port), one) if port.count is None else _one_input(port, one) for one in value]
    return _one_input(port, value)


def _one_input(port, value):
    if isinstance(port, InputScalar):
        return rg.cast(port.types[0], value) if port.types else rg.Expr(value)
    return value if isinstance(value, (rg.Func, rg.ImageParam)) else rg.Func(rg.Buffer(value))


def _plain(func):
    """The user's name for a Func, without the number that makes it unique."""
    return func.name().split("$")[0]


def create_callable_from_generator(target, name, params=None):
    """Compiles a registered generator, with these values of its parameters, to a function of inputs and outputs."""
    if name not in generators:
        raise error(CompileError, f'make the generator "{name}"',
                    "a generator is created by the name that it is registered under",
                    f"there are {', '.join(generators) or 'none'}", "Name one of them")
    return generators[name](target, **(params or {})).compile_to_callable()


def alias(**aliases):
    """Registers the class under more names, with other values of its parameters. Put `@alias(wide={"radius": 4})` above
    `@generator`."""
    def register(cls):
        for name, given in aliases.items():
            def init(self, target=None, _given=given, **params):
                cls.__init__(self, target, **{**_given, **params})
            generator(name)(type(name, (cls,), {"__init__": init}))
        return cls
    return register


def generator(name=""):
    """Registers a class under a name, for main() and command lines, and makes it a Generator."""
    def register(cls):
        if not issubclass(cls, Generator):
            body = {k: v for k, v in vars(cls).items() if k not in ("__dict__", "__weakref__")}
            cls = type(cls.__name__, (cls, Generator) if cls.__bases__ != (object,) else (Generator,), body)
        cls._name = name or cls.__name__
        if cls._name in generators:
            raise error(CompileError, f'register the generator "{cls._name}"', "a name is registered once",
                        f"it is {generators[cls._name]!r} already", "Give it another name")
        generators[cls._name] = cls
        return cls
    return register
