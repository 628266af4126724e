// Hobble in C# by P/Invoke, for Unity, Godot or any .NET program. hobble.h explains units, axes and errors. Put the compiled runtime
// (hobble.dll, libhobble.so, libhobble.dylib) where your program looks for native libraries. Tried under Mono: see Walk.cs.
using System;
using System.Runtime.InteropServices;
using System.Text;

public sealed class Hobble : IDisposable
{
    [StructLayout(LayoutKind.Sequential)]
    public struct Target
    {
        public double velocityX, velocityZ, facingX, facingZ, stand, walk, jog, crouch, jump, bump;
        public int gait;
    }

    // The height of the ground in cm at x, z.
    public delegate double Height(double x, double z);

    public const int BySpeed = -1;
    const int Why = 160;
    const string Library = "hobble";

    [UnmanagedFunctionPointer(CallingConvention.Cdecl)] delegate void LookUp(IntPtr user, int count, IntPtr points, IntPtr heights);

    [StructLayout(LayoutKind.Sequential)]
    struct Ground
    {
        public IntPtr function, user, heights;
        public int rows, columns;
        public double cell, centreX, centreZ;
    }

    [DllImport(Library)] static extern UIntPtr hobble_size(IntPtr file, UIntPtr bytes, int characters, byte[] why);
    [DllImport(Library)] static extern IntPtr hobble_create(IntPtr file, UIntPtr bytes, int characters, IntPtr memory, UIntPtr size, byte[] why);
    [DllImport(Library)] static extern IntPtr hobble_error(int code);
    [DllImport(Library)] static extern int hobble_reset(IntPtr h, int character, double x, double z, double yaw);
    [DllImport(Library)] static extern int hobble_frame(IntPtr h, [In] Target[] targets, IntPtr ground);
    [DllImport(Library, EntryPoint = "hobble_frame")] static extern int hobble_frame_on(IntPtr h, [In] Target[] targets, ref Ground ground);
    [DllImport(Library)] static extern int hobble_column(IntPtr h, byte[] channel, byte[] name);
    [DllImport(Library)] static extern int hobble_vary(IntPtr h, int character, double amount, uint seed);
    [DllImport(Library)] static extern int hobble_set(IntPtr h, int character, int column, double value);
    [DllImport(Library)] static extern int hobble_gait(IntPtr h, byte[] name);
    [DllImport(Library)] static extern int hobble_joints(IntPtr h);
    [DllImport(Library)] static extern IntPtr hobble_joint_name(IntPtr h, int joint);
    [DllImport(Library)] static extern IntPtr hobble_root(IntPtr h, int character);
    [DllImport(Library)] static extern int hobble_bones(IntPtr h, int character, [Out] double[] positions, [Out] double[] rotations);

    readonly IntPtr file, memory, h;
    readonly double[] root = new double[3];
    readonly LookUp lookUp; // kept, so that it is not collected while C has it
    Height height;

    // One for each character; `Frame` reads them.
    public readonly Target[] targets;
    // The pose of one character after `ReadPose`: (joints, 3) cm and (joints, 4) quaternions w, x, y, z, in the world.
    public readonly double[] positions, rotations;
    public int Joints { get { return positions.Length / 3; } }

    // bytes: content of character.hob. Throws ArgumentException with the reason if it is refused.
    public Hobble(byte[] bytes, int characters = 1)
    {
        var why = new byte[Why];
        UIntPtr count = (UIntPtr)bytes.Length;
        file = Marshal.AllocHGlobal(bytes.Length);
        Marshal.Copy(bytes, 0, file, bytes.Length);
        UIntPtr size = hobble_size(file, count, characters, why);
        if (size == UIntPtr.Zero)
        {
            Marshal.FreeHGlobal(file);
            throw new ArgumentException(Encoding.UTF8.GetString(why).TrimEnd('\0'));
        }
        memory = Marshal.AllocHGlobal((IntPtr)(long)size);
        h = hobble_create(file, count, characters, memory, size, why);
        targets = new Target[characters];
        for (int i = 0; i < characters; i++) targets[i].gait = BySpeed;
        positions = new double[3 * hobble_joints(h)];
        rotations = new double[4 * hobble_joints(h)];
        lookUp = FindHeights;
    }

    public void Dispose()
    {
        Marshal.FreeHGlobal(memory);
        Marshal.FreeHGlobal(file);
    }

    static byte[] Text(string text) { return text == null ? null : Encoding.UTF8.GetBytes(text + "\0"); }

    static int Check(int code)
    {
        if (code < 0) throw new ArgumentException(Marshal.PtrToStringAnsi(hobble_error(code)));
        return code;
    }

    void FindHeights(IntPtr user, int count, IntPtr points, IntPtr heights)
    {
        var at = new double[2 * count];
        var found = new double[count];
        Marshal.Copy(points, at, 0, at.Length);
        for (int i = 0; i < count; i++) found[i] = height(at[2 * i], at[2 * i + 1]);
        Marshal.Copy(found, 0, heights, count);
    }

    public int Gait(string name) { return Check(hobble_gait(h, Text(name))); }
    public string JointName(int joint) { return Marshal.PtrToStringAnsi(hobble_joint_name(h, joint)); }
    // How much its steps differ: 0 not at all, 1 as those of people do. The same seed gives the same walk.
    public void Vary(int character, double amount, uint seed) { Check(hobble_vary(h, character, amount, seed)); }
    public void Reset(int character, double x, double z, double yaw) { Check(hobble_reset(h, character, x, z, yaw)); }

    // Sets a value, such as ("injury", "left thigh", 7).
    public void Set(int character, string channel, string part, double value)
    {
        Check(hobble_set(h, character, Check(hobble_column(h, Text(channel), Text(part))), value));
    }

    // Runs one frame, a sixtieth of a second. ground: null is flat.
    public void Frame(Height ground = null)
    {
        height = ground;
        if (ground == null) { Check(hobble_frame(h, targets, IntPtr.Zero)); return; }
        var uneven = new Ground { function = Marshal.GetFunctionPointerForDelegate(lookUp) };
        Check(hobble_frame_on(h, targets, ref uneven));
    }

    // Writes the pose of a character, with bones of constant length, into `positions` and `rotations`.
    public void ReadPose(int character = 0) { Check(hobble_bones(h, character, positions, rotations)); }

    public double[] Root(int character = 0)
    {
        Marshal.Copy(hobble_root(h, character), root, 0, 3);
        return root;
    }
}
