// A walk on a slope, in C#. On Linux:
//   cc -O3 -march=x86-64-v3 -shared -fPIC ../hobble.c -o libhobble.so -lm
//   mcs Hobble.cs Walk.cs -out:walk.exe && LD_LIBRARY_PATH=. mono walk.exe ../character.hob
using System;
using System.Globalization;
using System.IO;

public static class Walk
{
    public static void Main(string[] arguments)
    {
        CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
        using (var walker = new Hobble(File.ReadAllBytes(arguments[0])))
        {
            walker.targets[0].velocityZ = 2.5;
            for (int frame = 1; frame <= 120; frame++)
            {
                walker.Frame((x, z) => .05 * z);
                double[] root = walker.Root();
                if (frame % 30 == 0) Console.WriteLine("after {0} frames the root is at {1:F1}, {2:F1}, {3:F1} cm", frame, root[0], root[1], root[2]);
            }
            walker.ReadPose();
            Console.WriteLine("{0} is at {1:F3}, {2:F3}, {3:F3} cm", walker.JointName(walker.Joints - 1), walker.positions[3 * walker.Joints - 3],
                walker.positions[3 * walker.Joints - 2], walker.positions[3 * walker.Joints - 1]);
        }
    }
}
