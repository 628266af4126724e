// Hobble in Unity: only written, never compiled. Put hobble.dll (libhobble.so, libhobble.dylib) into Assets/Plugins and
// character.hob as character.bytes into Assets. `joints` are the transforms of the joints, in the order of the file.
using System;
using System.Runtime.InteropServices;
using UnityEngine;

public class HobbleCharacter : MonoBehaviour
{
    [StructLayout(LayoutKind.Sequential)]
    struct Target
    {
        public double velocityX, velocityZ, facingX, facingZ, stand, walk, jog, crouch, jump, bump;
        public int gait;
    }

    const int BySpeed = -1, Why = 160;
    [DllImport("hobble")] static extern UIntPtr hobble_size(IntPtr file, UIntPtr bytes, int characters, byte[] why);
    [DllImport("hobble")] static extern IntPtr hobble_create(IntPtr file, UIntPtr bytes, int characters, IntPtr memory, UIntPtr size, byte[] why);
    [DllImport("hobble")] static extern int hobble_frame(IntPtr h, ref Target target, IntPtr ground);
    [DllImport("hobble")] static extern int hobble_column(IntPtr h, [MarshalAs(UnmanagedType.LPUTF8Str)] string channel, [MarshalAs(UnmanagedType.LPUTF8Str)] string name);
    [DllImport("hobble")] static extern int hobble_set(IntPtr h, int character, int column, double value);
    [DllImport("hobble")] static extern int hobble_joints(IntPtr h);
    [DllImport("hobble")] static extern IntPtr hobble_positions(IntPtr h, int character);
    [DllImport("hobble")] static extern IntPtr hobble_rotations(IntPtr h, int character);

    public TextAsset character;
    public Transform[] joints;
    public Vector3 velocity = new Vector3(0, 0, 1.5f); // metres a second, in the world
    [Range(0, 10)] public double leftThigh;

    IntPtr file, memory, h;
    double due;
    double[] positions, rotations;

    void Start()
    {
        byte[] bytes = character.bytes, why = new byte[Why];
        file = Marshal.AllocHGlobal(bytes.Length);
        Marshal.Copy(bytes, 0, file, bytes.Length);
        UIntPtr count = (UIntPtr)bytes.Length, size = hobble_size(file, count, 1, why);
        if (size == UIntPtr.Zero) throw new Exception(System.Text.Encoding.UTF8.GetString(why).TrimEnd('\0'));
        memory = Marshal.AllocHGlobal((IntPtr)(long)size);
        h = hobble_create(file, count, 1, memory, size, why);
        positions = new double[3 * hobble_joints(h)];
        rotations = new double[4 * hobble_joints(h)];
    }

    void Update()
    {
        // Unity is left-handed and in metres: x changes its sign.
        var target = new Target { velocityX = -velocity.x * 100 / 60, velocityZ = velocity.z * 100 / 60, gait = BySpeed };
        int column = hobble_column(h, "injury", "left thigh");
        if (column >= 0) hobble_set(h, 0, column, leftThigh);
        for (due += Math.Min(Time.deltaTime, .1) * 60; due >= 1; due--) hobble_frame(h, ref target, IntPtr.Zero);
        Marshal.Copy(hobble_positions(h, 0), positions, 0, positions.Length);
        Marshal.Copy(hobble_rotations(h, 0), rotations, 0, rotations.Length);
        for (int j = 0; j < joints.Length; j++)
        {
            joints[j].position = new Vector3(-(float)positions[3 * j], (float)positions[3 * j + 1], (float)positions[3 * j + 2]) / 100;
            joints[j].rotation = new Quaternion((float)rotations[4 * j + 1], -(float)rotations[4 * j + 2], -(float)rotations[4 * j + 3], (float)rotations[4 * j]);
        }
    }

    void OnDestroy()
    {
        Marshal.FreeHGlobal(memory);
        Marshal.FreeHGlobal(file);
    }
}
