"""The first steps: a Func, its Vars, its definition, and realizing it over a region."""
import retrograde as rg

# A Func maps points to values. A definition is data: it computes nothing.
checker = rg.Func("checker")
column, row = rg.Var("column"), rg.Var("row")
square = (column / 8 + row / 8) % 2
checker[column, row] = rg.select(square == 0, 40, 200) + column

# realize() computes every point of a rectangle that starts at the origin.
board = checker.realize([32, 16])
print(f"{board.width()} x {board.height()} x {board.channels()}, {board.dimensions()} dimensions")
for y in range(0, board.height(), 5):
    print("".join("%5d" % board[x, y] for x in range(0, board.width(), 7)))

# The same Func can be realized at any size, and several other Funcs can read it.
inverted = rg.Func()
inverted[column, row] = 255 - checker[column, row]
small = inverted.realize([4, 2])
print("inverted:", small[0, 0], small[1, 0], small[3, 0], small[3, 1])

# A Func without dimensions is one value.
answer = rg.Func()
answer[()] = rg.f64(checker[9, 1]) / 4
print("answer: %g" % answer.realize()[()])

# Properties of a Func.
print('%s: %d arguments, first "%s", defined: %d'
      % (checker.name(), checker.dimensions(), checker.args()[0].name(), checker.defined()))
