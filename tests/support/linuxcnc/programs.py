"""programs.py: seeded part programs over all that both LinuxCNC and this project read, in the many ways in which they may be
written. Axes "xy" are those of a sheet; "hexapod" adds Z, A, B, other planes, drilling cycles and tool lengths.

Left out is what is read otherwise on purpose (services/trajectory/README.md): kerf compensation, splines, F in a line that changes
units, G94 without F, turned offsets, drilling with a leaning tool. And what rs274 does unlike the machine it stands for: its machine
counts in inches (so that parameters of offsets are not read here) and does not convert a tool's length when units change; after
a break it leaves do loops at their first end."""
import math
import random

FUNCTIONS = ("SIN[30]*20", "COS[60]*10", "ATAN[1]/[1]", "SQRT[49]", "ABS[-3.5]", "ROUND[2.5]", "FIX[-2.7]", "FUP[2.1]", "7 MOD 4",
             "2**3", "EXP[1]", "LN[10]", "ACOS[0.5]/4", "10/4", "5 GT 3", "1 AND 0", "1 XOR 1", "-3 MOD 2", "TAN[45]*3",
             "2 EQ 2.0000001", "3 - -2", "2*3**2", "8/2/2", "5 MOD 3*2", "1 OR 0 AND 0")
STATE = ("x", "y", "z", "a", "feed", "imperial", "incremental", "motion_mode", "plane", "coord_system", "relative",
         "ijk_absolute_mode", "inverse_time", "units_per_minute", "absolute", "metric", "value", "call_level")
HABITS = ("{} G90 G17", "{}", "g90{}g40g49g80", "{} G90 G94 G64", "G17 {} G90 G91.1", "G0 G17 {} G40 G49 G80 G90")


class Program:
    def __init__(self, seed, axes):
        self.random = random.Random(f"{axes} {seed}")
        self.spatial = axes != "xy"
        self.turns = self.spatial and self.random.random() < 0.4
        self.lines, self.depth, self.label, self.subs = [], 0, 100, []
        self.units = self.pick((("G21",), ("G21",), ("G20",), ("G21", "G20")))
        self.breaks = self.random.random() < 0.5  # else do loops

    def text(self):
        taped = self.random.random() < 0.1
        self.lines += ["%"] if taped else []
        self.lines += [self.pick(HABITS).format(self.units[0]), "F1200", "G0 X10 Y20" + (" Z30" if self.spatial else "")]
        for _ in range(self.random.randint(3, 25)):
            self.statement()
        self.lines.append(self.pick(("M2", "M30")))
        self.lines += ["%"] if taped else []
        return "\n".join(self.lines) + "\n"

    # ---- how things are written ----

    def pick(self, choices):
        return self.random.choice(choices)

    def chance(self, share):
        return self.random.random() < share

    def number(self, low, high):
        text = f"{round(self.random.uniform(low, high), self.pick((0, 1, 2, 3))):.3f}"
        dice = self.random.random()
        if dice < 0.3:
            text = text.rstrip("0")
        if dice < 0.1 and text.startswith("0."):
            text = text[1:] if text != "0." else "0"
        elif dice < 0.15 and not text.startswith("-"):
            text = "+" + text
        elif dice > 0.98:
            text = f"[{self.pick(FUNCTIONS)}]"
        elif dice > 0.96:
            text = self.variable()
        elif dice > 0.93:
            text = f"[{text}*{self.pick(('1.5', '2', '0.5'))}-{self.variable()}]"
        return text

    def variable(self):
        return f"#{self.random.randint(31, 36)}"

    def place(self, low=-50, high=300):
        words = [axis + self.number(low, high) for axis in "XY" if self.chance(0.7)] or ["X" + self.number(low, high)]
        if self.spatial and self.chance(0.4):
            words.append("Z" + self.number(-30, 60))
        if self.turns and self.chance(0.2):
            words.append(self.pick("AB") + self.number(-20, 20))
        self.random.shuffle(words)
        return " ".join(words)

    def write(self, line):
        dice = self.random.random()
        if dice < 0.05:
            line = line.lower()
        elif dice < 0.08:
            line = line.replace(" ", "")
        elif dice < 0.10:
            line = "  ".join(line)
        elif dice < 0.13:
            line = f"N{self.random.randint(0, 9999)} {line}"
        elif dice < 0.15:
            line += " (a comment)"
        elif dice < 0.17:
            line += " ; rest G1 X9"
        elif dice < 0.18:
            line = "/" + line
        elif dice < 0.19:
            line = line.replace(" ", "\t")
        self.lines.append(line)

    # ---- statements ----

    def statement(self):
        self.pick(self.STATEMENTS)(self)

    def straight(self):
        self.write(self.pick(("G1 ", "G1 ", "G0 ", "G01 ", "g00 ")) + self.place() + (f" F{self.random.randint(100, 6000)}" if self.chance(0.2) else ""))
        if self.chance(0.4):
            self.write(self.place())

    def arc_by_centre(self, first="X", second="Y", words=("I", "J"), plane=""):
        centre = self.random.uniform(-40, 40), self.random.uniform(-40, 40)
        turn = self.random.uniform(-6.2, 6.2)
        ends = (centre[0] - centre[0] * math.cos(turn) + centre[1] * math.sin(turn),
                centre[1] - centre[1] * math.cos(turn) - centre[0] * math.sin(turn))
        line = [f"{first}{ends[0]:.4f}", f"{second}{ends[1]:.4f}", f"{words[0]}{centre[0]:.4f}", f"{words[1]}{centre[1]:.4f}"]
        line = line[2:] if self.chance(0.1) else line
        line += [f"P{self.random.randint(1, 3)}"] if self.chance(0.15) else []
        line += ["Z" + self.number(-10, 10)] if self.spatial and not plane and self.chance(0.3) else []
        self.random.shuffle(line)
        self.lines.append(f"G91 G91.1 {plane}")
        self.write(self.pick(("G2 ", "G3 ", "G02 ")) + " ".join(line))
        self.lines.append("G90 G17")

    def arc_by_radius(self):
        x, y = self.random.uniform(-20, 20), self.random.uniform(-20, 20)
        radius = math.hypot(x, y) * self.random.uniform(0.51, 2) * self.pick((1, 1, -1))
        self.lines.append("G91")
        self.write(f"{self.pick(('G2', 'G3'))} X{x:.4f} Y{y:.4f} R{radius:.4f}" + (" P2" if self.chance(0.1) else ""))
        self.lines.append("G90")

    def arc_in_another_plane(self):
        if not self.spatial:
            return self.straight()
        return self.arc_by_centre("Z", "X", ("K", "I"), "G18") if self.chance(0.5) else self.arc_by_centre("Y", "Z", ("J", "K"), "G19")

    def drilling(self):
        if not self.spatial or self.turns:
            return self.straight()
        uniform = self.random.uniform
        repeats = f" L{self.random.randint(1, 3)}" if self.chance(0.2) else ""
        self.write(f"{self.pick(('G98', 'G99'))} {self.pick(('G81', 'G82 P0.2', 'G83 Q2.5'))} X{uniform(0, 50):.2f} Y{uniform(0, 50):.2f} "
                   f"Z{uniform(-10, -1):.2f} R{uniform(1, 9):.2f}{repeats}")
        for _ in range(self.random.randint(0, 2)):
            self.write(f"X{uniform(0, 50):.2f}" + (f" Z{uniform(-12, -2):.1f}" if self.chance(0.2) else ""))
        return self.write("G80" if self.chance(0.5) else "G80 G0 X5 Y6 Z40")

    def offsets(self):
        self.write(self.pick((self.pick(("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")),
                              f"G10 L{self.pick((2, 20))} P{self.random.randint(0, 9)} {self.place()}",
                              f"G92 {self.place()}", "G92.1", "G92.2", "G92.3", f"G52 {self.place()}",
                              self.pick(("G28", "G30", "G28.1", "G30.1", f"G28 {self.place()}", f"G30 {self.place()}")),
                              f"G53 {self.pick(('G0', 'G1'))} {self.place()}")))

    def modes(self):
        self.write(self.pick(("G90", "G90", "G91", self.pick(self.units), self.pick(self.units), "G61", "G64 P0.05", "G64", "G17", "M5", "M9",
                              f"F{self.random.randint(10, 9000)}", f"G4 P{abs(self.random.uniform(0, 3)):.3f}",
                              "G90 G54 G64 G40", "G17 G91.1 G1 X5 Y6", "G80 G40 G0 X1")))

    def inverse_time(self):
        self.lines.append("G93")
        self.write(f"G1 {self.place()} F{self.random.randint(1, 20)}")
        self.write("G94 F800")

    def tool_length(self):
        self.write(self.pick(("G43.1 Z" + self.number(0, 20), "G49", "G43.1 X1 Z3", "G49")) if self.spatial else "G49")

    def setting(self):
        a, b = self.variable(), self.random.randint(31, 36)
        return self.write(self.pick((f"{a}={self.number(-9, 9)}", f"{a} = [#{b}+{self.number(0, 3)}]", f"#[{self.random.randint(31, 33)}+1]=2.5",
                              f"{a}=#{5420 + self.random.randint(0, 2)}", f"{a}=#5220", f"{a}=#5210", f"{a}=#<_{self.pick(STATE)}>", f"G1 X{a} Y[#{b}+#31] #31=4 F900", "#33=34 #32=##33")))

    def named(self):
        name = self.pick(("a", "len", "my var", "_g", "B2"))
        self.write(f"#<{name}> = {self.number(0, 9)}")
        self.write(f"G1 X[#<{name.upper() if self.chance(0.2) else name}>*3] Y[EXISTS[#<{self.pick((name, 'zz'))}>]*5] F600")

    def block(self, most=3):
        self.depth += 1
        for _ in range(self.random.randint(1, most)):
            self.statement()
        self.depth -= 1

    def flow(self):
        if self.depth > 2:
            return self.straight()
        label, self.label = self.label, self.label + 1
        return self.pick((self.branch, self.branch, self.repeat, self.loop, self.loop if self.breaks else self.loop_at_the_end))(f"{self.pick('oO')}{label}", label)

    def branch(self, word, _):
        self.lines.append(f"{word} if [{self.variable()} {self.pick(('GT', 'LT', 'EQ', 'NE', 'GE', 'LE'))} {self.random.randint(-3, 5)}]")
        self.block()
        if self.chance(0.4):
            self.lines.append(f"{word} elseif [#31 lt #32]")
            self.block()
        if self.chance(0.5):
            self.lines.append(f"{word} else")
            self.block()
        self.lines.append(f"{word} endif")

    def repeat(self, word, _):
        self.lines.append(f"{word} repeat [{self.random.randint(0, 4)}]")
        self.block()
        self.lines.append(f"{word} endrepeat")

    def loop(self, word, label):
        count = f"#{40 + self.depth}"
        self.lines += [f"{count}=0", f"{word} while [{count} lt {self.random.randint(0, 4)}]", f"{count}=[{count}+1]"]
        self.block()
        if self.breaks and self.chance(0.3):
            self.lines += [f"o{label + 5000} if [{count} eq 2]", f"o{label} {self.pick(('break', 'continue'))}", f"o{label + 5000} endif"]
            self.block(1)
        self.lines.append(f"{word} endwhile")

    def loop_at_the_end(self, word, _):
        count = f"#{40 + self.depth}"
        self.lines += [f"{count}=0", f"{word} do", f"{count}=[{count}+1]"]
        self.block()
        self.lines.append(f"{word} while [{count} lt {self.random.randint(0, 3)}]")

    def call(self):
        if self.depth:
            return self.straight()
        if not self.subs or self.chance(0.5):
            self.subroutine()
        self.lines.append(f"o{self.pick(self.subs)} call" + "".join(f" [{self.number(0, 20)}]" for _ in range(self.random.randint(0, 3))))
        return self.write("#31=#<_value>") if self.chance(0.4) else None

    def subroutine(self):
        name = self.pick((str(self.label), f"<sub{self.label}>"))
        label, self.label = self.label, self.label + 1
        self.lines += [f"o{name} sub", "G1 X[#1] Y#2 F[500+#3]"]
        self.block(2)
        if self.chance(0.3):
            value = " [5]" if self.chance(0.5) else ""
            self.lines += [f"o{label + 7000} if [#1 gt 2]", f"o{name} return{value}", f"o{label + 7000} endif"]
        self.lines.append(f"o{name} endsub" + (" [#1*2]" if self.chance(0.5) else ""))
        self.subs.append(name)

    STATEMENTS = ([straight] * 12 + [arc_by_centre] * 6 + [arc_by_radius] * 4 + [arc_in_another_plane] * 2 + [drilling] * 3 + [offsets] * 10 +
                  [modes] * 6 + [inverse_time] + [tool_length] + [setting] * 5 + [named] * 2 + [flow] * 5 + [call] * 2)
